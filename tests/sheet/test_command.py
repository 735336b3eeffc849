"""`mrfit measure sheet`: tables, files, units, comparison, hostile names, and bad input in one line."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

import mrfit
from datasets.rig.closed_forms import Rig
from mrfit.sheet import measured
from mrfit.sheet.write import written
from tests.conftest import ROOT, Run

LOGS = ROOT / "datasets" / "damper-sines"
LIMITS = ROOT / "datasets" / "limits"


def log(path: Path, rig: Rig, gain: float = 1.0) -> Path:
    displacement, force = rig.record()
    table = np.stack([np.arange(len(force)) / rig.rate, 1e3 * displacement, gain * force], axis=1)
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savetxt(path, table, "%.7g", ",", header="time (s),displacement (mm),force (N)", comments="")
    return path


def test_a_sheet_of_six_conditions_with_limits(tmp_path: Path, mrfit: Run) -> None:
    out = tmp_path / "out"
    run = mrfit(
        *("measure", "sheet", str(LOGS), "--limits", str(LIMITS / "damper.toml"), "--out", str(out)),
        *("--about", "specimen=<b>MR & 7</b>"),
    )
    assert (
        "limits 'Damper of datasets/damper-sines': 5 verdicts on 2 of 6 conditions: pass"
        in " ".join(run.stdout.split())
        and "positive velocity is rebound" in run.stdout
    )
    assert {p.name for p in out.iterdir()} == {"sheet.html", "sheet.csv", "sheet.json"}
    page = (out / "sheet.html").read_text()
    assert "&lt;b&gt;MR &amp; 7&lt;/b&gt;" in page and "<b>MR" not in page and "<script" not in page
    rows = list(csv.DictReader((out / "sheet.csv").read_text().splitlines()))
    found = {(r["condition"], r["quantity"]): r for r in rows}
    force = found["sine-1Hz-10mm-1A", "Fmax+"]
    assert force["verdict"] == "pass" and 600 < float(force["low"]) < float(force["value"]) < 700
    assert "no slow test" in found["sine-1Hz-10mm-1A", "friction"]["reason"]
    file = json.loads((out / "sheet.json").read_text())
    assert file["schema"] == "mrfit/sheet/1" and file["units"][0]["verdict"] == "pass"
    ranges = [a["quantity"] for a in file["units"][0]["across"] if a["quantity"]["name"] == "dynamic range"]
    assert len(ranges) == 3 and all(2.0 < r["low"] < r["value"] < r["high"] < 4.0 for r in ranges)


def test_processes_change_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    logs = mrfit.read([log(tmp_path / f"{k}.csv", Rig("gas", 2.0, 200.0, noise=0.005, seed=k)) for k in range(3)])
    alone = mrfit.sheet(logs, unit_from="{unit}.csv").table
    monkeypatch.setattr(measured, "LOGS_FOR_PROCESSES", 2)
    found = mrfit.sheet(logs, unit_from="{unit}.csv", jobs=2)
    assert found.table.equals(alone)
    for jobs in (1, 2):
        written(found.computed, tmp_path / str(jobs), jobs=jobs)
    for name in ("sheet.html", "sheet.csv", "sheet.json"):
        assert (tmp_path / "1" / name).read_bytes() == (tmp_path / "2" / name).read_bytes()


def test_conditions_of_one_unit_do_not_stand_out(tmp_path: Path) -> None:
    """Five tests of a unit that are named alike are no five units."""
    for k in range(5):
        log(tmp_path / f"{k}.csv", Rig("gas", 2.0, 200.0, noise=0.001, seed=k), 3.0 if k == 4 else 1.0)
    found = mrfit.sheet(mrfit.read(tmp_path)).content
    assert len(found.units) == 1 and len(found.units[0].conditions) == 5 and not found.stands_out


def test_the_same_command_gives_the_same_bytes(tmp_path: Path, mrfit: Run) -> None:
    for unit in ("A", "B"):
        log(tmp_path / f"{unit}.csv", Rig("gas", 1.0, 200.0, noise=0.005, seed=ord(unit)))
    for name in ("one", "two"):
        options = ("--unit-from", "{unit}.csv", "--pdf", "--out", str(tmp_path / name))
        mrfit("measure", "sheet", str(tmp_path / "A.csv"), str(tmp_path / "B.csv"), *options)
    assert (tmp_path / "one" / "sheet-A.pdf").read_bytes().startswith(b"%PDF")
    for name in ("sheet.html", "sheet.csv", "sheet.json", "sheet-A.pdf", "sheet-B.pdf"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


def test_units_are_judged_by_two_levels(tmp_path: Path, mrfit: Run) -> None:
    for number, gain in enumerate((1.0, 1.01, 0.99, 1.0, 1.4)):
        log(tmp_path / "logs" / f"S{number}_1Hz.csv", Rig("viscous", 1.0, 200.0, noise=0.003, seed=number), gain)
    target = Rig("viscous", 1.0, 200.0).truth()["Fmax+"]
    limits = tmp_path / "l.toml"
    limits.write_text(
        f'[[limit]]\nquantity = "Fmax+"\ntarget = {target}\ntolerance = "15 %"\nbatch_tolerance = "10 %"\n'
    )
    run = mrfit(
        *("measure", "sheet", str(tmp_path / "logs"), "--unit-from", "{unit}_*.csv", "--limits", str(limits)),
        *("--out", str(tmp_path / "out"), "--json"),
    )
    file = json.loads(run.stdout)
    assert {u["unit"]: u["verdict"] for u in file["units"]} == {f"S{k}": "pass" if k < 4 else "fail" for k in range(5)}
    [batch] = file["batch"]
    assert (
        batch["level"] == "batch"
        and batch["verdict"] == "pass"
        and batch["value"] == pytest.approx(1.08 * target, rel=5e-3)
    )
    assert any(s["unit"] == "S4" and s["quantity"] == "Fmax+" for s in file["stands_out"])
    assert "All units" in (tmp_path / "out" / "sheet.html").read_text()


def test_before_and_after_are_compared_by_condition(tmp_path: Path, mrfit: Run) -> None:
    before = log(tmp_path / "before" / "a.csv", Rig("gas", 1.0, 200.0, noise=0.002, seed=1))
    after = log(tmp_path / "after" / "a.csv", Rig("gas", 1.0, 200.0, noise=0.002, seed=2), 0.9)
    run = mrfit("measure", "sheet", str(after), "--against", str(before), "--out", str(tmp_path / "o"), "--json")
    changes = {c["quantity"]: c for c in json.loads(run.stdout)["changes"]}
    assert changes["E"]["changed"] and changes["E"]["low"] < -0.1 < changes["E"]["high"]
    assert not changes["ratio"]["changed"]


def test_negated_force_and_skew_are_told(tmp_path: Path, mrfit: Run) -> None:
    path = log(tmp_path / "a.csv", Rig("bingham", 2.0, 200.0, noise=1e-3), -1.0)
    run = mrfit("measure", "sheet", str(path), "--out", str(tmp_path / "o"))
    assert "the force is negated" in run.stdout and "one sample (5 ms)" in run.stdout
    truth = Rig("bingham", 2.0, 200.0).truth()["E"]
    file = json.loads((tmp_path / "o" / "sheet.json").read_text())
    row = next(q for q in file["units"][0]["conditions"][0]["quantities"] if q["name"] == "E")
    assert row["value"] == pytest.approx(truth, rel=3e-3)


def refused(run: object, code: int, text: str) -> None:
    lines = [line for line in run.stderr.splitlines() if line]  # type: ignore[attr-defined]
    assert run.returncode == code and len(lines) == 1 and text in lines[0], run.stderr  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("frequency", "text"),
    [(0.05, "less than a whole cycle"), (0.0, "the displacement is constant"), (1.0, "the force is constant")],
)
def test_logs_without_a_sheet_say_why(frequency: float, text: str) -> None:
    time = np.arange(1000) / 100.0
    moved = 0.01 * np.sin(2 * np.pi * frequency * time - np.pi / 2)
    force = np.full(1000, 3.0) if frequency == 1.0 else np.cos(time)
    with pytest.raises(mrfit.DataError, match=text):
        mrfit.sheet(mrfit.Recording.from_arrays(dt=0.01, displacement=moved, force=force, name="a"))


def test_a_bad_log_is_one_line(tmp_path: Path, mrfit: Run) -> None:
    path = log(tmp_path / "a.csv", Rig("viscous", 1.0, 100.0), 0.0)
    refused(
        mrfit("measure", "sheet", str(path), "--out", str(tmp_path / "o")), 1, "the force is constant but for noise"
    )
    assert not (tmp_path / "o").exists()


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (("--unit-from", "S*.csv"), "has to hold {unit} once"),
        (("--unit-from", "{unit}.mat"), "does not match"),
        (("--limits", "none.toml"), "none.toml: cannot be read"),
        (("--about", "serial"), "--about takes NAME=VALUE, not 'serial'"),
        (("--rebound", "up"), "--rebound takes positive or negative, not 'up'"),
    ],
)
def test_bad_options_are_one_line_each(tmp_path: Path, mrfit: Run, options: tuple[str, ...], text: str) -> None:
    path = log(tmp_path / "a.csv", Rig("viscous", 1.0, 100.0))
    refused(mrfit("measure", "sheet", str(path), *options), 2, text)


def test_a_pipeline_file_writes_the_sheet_of_its_logs(tmp_path: Path, mrfit: Run) -> None:
    log(tmp_path / "logs" / "a.csv", Rig("gas", 1.0, 200.0, noise=0.002))
    (tmp_path / "l.toml").write_text('[[limit]]\nquantity = "E"\nleast = 1.0\n')
    (tmp_path / "p.toml").write_text('[ingest]\nlogs = ["logs/*.csv"]\n[sheet]\nlimits = "l.toml"\npdf = true\n')
    run = mrfit("run", "p.toml", "--work", "w")
    assert run.returncode == 0 and "of 1 unit, limits 'l.toml': 1 verdict on 1 of 1 condition: pass" in run.stdout, (
        run.stderr
    )
    assert {p.name for p in (tmp_path / "w" / "sheet").iterdir()} == {
        *("sheet.html", "sheet.csv", "sheet.json", "sheet.pdf")
    }


def test_python_gives_the_same_sheet() -> None:
    displacement, force = Rig("bingham", 1.0, 200.0, noise=0.002).record()
    one = mrfit.Recording.from_arrays(dt=1 / 200.0, displacement=displacement, force=force, name="a")
    found = mrfit.sheet(one, about={"serial": "7"})
    table = found.table.set_index("quantity")
    assert table.loc["E", "low"] < table.loc["E", "value"] < table.loc["E", "high"]
    assert table.loc["E", "value"] == pytest.approx(Rig("bingham", 1.0, 200.0).truth()["E"], rel=2e-3)
    assert found.plot().get_size_inches() == pytest.approx((8.27, 11.69)) and repr(found).startswith("<Sheet")
    with pytest.raises(mrfit.DataError, match="there is no unit 'x'"):
        found.plot("x")


def test_logs_that_allow_no_sheet_are_said_and_so_are_conditions_without_a_partner(mrfit, datasets, tmp_path):
    switched = str(datasets / "damper")
    alone = mrfit("measure", "sheet", switched, "--out", str(tmp_path / "o"))
    assert alone.returncode == 1 and not (tmp_path / "o").exists()
    assert "no test here gives a sheet, which needs steady cycles at a held current; " in alone.stderr
    one = str(datasets / "damper-sines" / "sine_1Hz_10mm_1A.csv")
    beside = mrfit("measure", "sheet", one, "--against", switched, "--out", str(tmp_path / "a"))
    assert beside.returncode == 0
    said = " ".join(beside.stdout.split())
    assert "left out: no condition is in both: nothing is compared" in said
    # one reason for each log, of a sine the current
    assert said.count("sine_1Hz_12mm.csv") == 1 and "sine_1Hz_12mm.csv: sine-1Hz-12mm: the current moves" in said
    assert "random_4mm.csv: no steady cycles" in said
