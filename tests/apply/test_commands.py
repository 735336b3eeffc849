"""``mrfit apply`` as a user calls it: a page and its numbers, and one line for what cannot be done."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import mrfit
from mrfit.apply.coil_stage import percent_text
from mrfit.apply.damper import Damper
from mrfit.cli import console
from mrfit.cli.main import app
from mrfit.io.schemas.apply import CurrentFile, FluxCommandFile, InvertFile, QuarterCarFile, TrackFile
from mrfit.io.schemas.fit import Fit
from mrfit.io.schemas.reading import load, of_json
from mrfit.io.workspace import plain
from tests.apply.dampers import controllable, monotone

Command = Callable[..., tuple[int, str]]
FILES = {
    "invert": InvertFile,
    "track": TrackFile,
    "quarter-car": QuarterCarFile,
    "current": CurrentFile,
    "flux-command": FluxCommandFile,
}
MMF = (("L", 0.03), ("i_c", 0.1), ("flux_y", 0.003), ("n", 1.3), ("rho", -0.3))
COIL = {"A": 0.8, "Lc": 0.02, "kappa": 3.5, "beta": 30.0, "gamma": 60.0, "n": 1.3, "D": 1.0}


def write_fit(work: Path, name: str, damper: Damper, sets: int = 1) -> None:
    spec = damper.assembly.spec
    parameters = [{"name": n, "value": value} for n, value in damper.parameters]
    result = {"condition": "all", "evaluations": 1, "parameters": parameters}
    dependence = {"orders": dict(damper.orders), "low": damper.low, "high": damper.high} if damper.orders else None
    row = {"condition": "all", "role": "train", "samples": 9}
    content = {
        **{"schema": "mrfit/fit/1", "name": name, "model": damper.model, "optimizer": "auto", "per": "all", "seed": 0},
        **{"output": spec.output, "inputs": list(spec.inputs), "results": [result] * sets, "metrics": [row]},
        "current_dependence": dependence,
        "warnings": [],
    }
    of_json(Fit, json.dumps(content))
    folder = work / "fits" / name
    folder.mkdir(parents=True)
    (folder / "fit.json").write_text(json.dumps(content), encoding="utf-8")


@pytest.fixture
def work(tmp_path: Path) -> Path:
    """A workspace with a fit of a damper with lag, one without, and fits that cannot be controlled."""
    folder = tmp_path / "w"
    lagging = monotone("tanh+current-lag", **{"current-lag.tau": 0.02})
    write_fit(folder, "lagging", lagging)
    write_fit(folder, "plain", monotone())
    write_fit(folder, "several", monotone(), sets=2)
    write_fit(folder, "memory", controllable("boucwen"))
    fixed = Damper("f", "bingham", (("fy", 90.0), ("C_inf", 900.0), ("f0", 0.0)), (), 0.0, 1.0)
    write_fit(folder, "no-current", fixed)
    write_fit(folder, "coil", Damper("coil", "boucwen-flux", tuple(COIL.items()), (), 0.0, 1.0))
    return folder


@pytest.fixture
def command(work: Path, capsys: pytest.CaptureFixture[str]) -> Command:
    """Run a command in the workspace; return its exit code and what it printed, or its one line."""

    def run(*arguments: object) -> tuple[int, str]:
        try:
            app(["apply", *map(str, arguments), "--work", str(work)], standalone_mode=False)
        except Exception as error:
            text, code = console.explain(error)
            assert "\n" not in text
            return code, text
        return 0, capsys.readouterr().out

    return run


def page_of(work: Path, name: str) -> tuple[str, dict[str, object]]:
    page = (work / "apply" / f"{name}.html").read_text(encoding="utf-8")
    assert page.count("<svg") >= 1 and "http" not in page.replace("http://www.w3.org", "")
    file = work / "apply" / f"{name}.json"
    document, content = load(file, FILES[name], "run it again"), json.loads(file.read_text(encoding="utf-8"))
    assert document is not None and plain(document) == content, "a file is read as it was written"
    return page, content


def test_invert_writes_currents_that_give_the_force(command: Command, work: Path) -> None:
    code, said = command("invert", "--fit", "plain", "--sine", "1:0.01:1", "--law", "c=2e4", "--json")
    assert code == 0
    row = json.loads(said)["motions"][0]
    assert row["explicit"] and row["greatest_error_where_reached"] < 1e-9
    page, content = page_of(work, "invert")
    assert content["fit"] == "plain" and "closed form" in page
    assert "c=2e4: c·v + k·x, c in N·s/m" in page and "Red: the desired force is outside." in page
    from pyarrow.parquet import read_table

    table = read_table(work / "apply" / "invert-1.parquet").to_pydict()
    assert len(table["current"]) == 1001 and max(table["current"]) <= 1.0
    assert command("invert", "--fit", "plain", "--sine", "1:0.01:1", "--law", "c=1e9")[0] == 0
    said = [n for n in page_of(work, "invert")[1]["notes"] if n.startswith("Out of reach in 100 % of the samples")]
    assert len(said) == 1
    assert command("invert", "--fit", "plain", "--sine", "1:0.01:1", "--law", "c=2e4", "--most", "0.5")[0] == 0
    weaker = read_table(work / "apply" / "invert-1.parquet").to_pydict()
    assert max(weaker["current"]) == pytest.approx(0.5 * max(table["current"]))
    assert "rms error (N)" in command("invert", "--fit", "plain", "--sine", "1:0.01:1", "--law", "c=2e4")[1]
    assert command("invert", "--fit", "memory", "--sine", "2:0.01:0.5", "--dt", "0.002", "--law", "c=1e4")[0] == 0


def test_invert_of_a_logs_own_force_is_its_current(command: Command, work: Path, tmp_path: Path) -> None:
    damper, t = monotone(), np.arange(2000) * 1e-3
    x, v = 0.01 * np.sin(4 * np.pi * t), 0.04 * np.pi * np.cos(4 * np.pi * t)
    force = damper.assembly.simulate(np.stack([x, v, np.full_like(x, 0.6)]), damper.theta, 1e-3)[0]
    log = tmp_path / "log.csv"
    np.savetxt(log, np.c_[t, x, v, force], "%.9g", ",", header="time [s],displacement [m],velocity [m/s],force [N]")
    log.write_text(log.read_text().removeprefix("# "))
    assert command("invert", "--fit", "plain", log)[0] == 0
    from pyarrow.parquet import read_table

    table = read_table(work / "apply" / "invert-1.parquet").to_pydict()
    fast = np.abs(np.array(table["force"])) > 300.0
    np.testing.assert_allclose(np.array(table["current"])[fast], 0.6, atol=1e-3)
    # its force as what a sine is to give: a file with time and force
    wanted = command("track", "--fit", "plain", "--sine", "2:0.01:1", "--desired", log, "--scheme", "feedforward")
    assert wanted[0] == 0
    short = command("track", "--fit", "plain", "--sine", "0.2:0.01:1", "--desired", log)
    assert short[0] == 1 and "ends after" in short[1]
    missing = tmp_path / "no_force.csv"
    missing.write_text("time [s],displacement [m]\n" + "".join(f"{k / 100},{k}\n" for k in range(200)))
    code, text = command("track", "--fit", "plain", "--sine", "2:0.01:1", "--desired", missing)
    assert code == 1 and "needs a column 'force'" in text


def test_what_is_not_drawn_has_no_words(command: Command, work: Path) -> None:
    assert command("invert", "--fit", "plain", "--sine", "1:0.01:1", "--law", "c=6000,k=0")[0] == 0
    page, content = page_of(work, "invert")
    outside = content["motions"][0]["shares"]["reached"] < 1.0  # type: ignore[index]
    assert ("Red:" in page) == outside
    assert command("track", "--fit", "plain", "--sine", "1:0.01:1", "--law", "c=2e4", "--scheme", "feedforward")[0] == 0
    page, content = page_of(work, "track")
    third = content["cases"][0]["regions"][2]["share"] > 0.0  # type: ignore[index]
    assert ("Red: region III" in page) == third and "at most 1.2 times the greatest current tested" in page


def test_track_says_what_the_lag_costs(command: Command, work: Path) -> None:
    code, said = command(
        "track", "--fit", "lagging", "--sine", "2:0.01:1", "--dt", "0.002", "--law", "c=1e4", "--law", "k=-5e4,c=1e4",
        "--law", "c=1e4",
    )  # fmt: skip
    assert code == 0 and "The lag costs uninverted" in said
    page, content = page_of(work, "track")
    cases = content["cases"]
    assert isinstance(cases, list) and len(cases) == 2 * 4 * 2
    assert "Red: region III of the first scheme." in page
    assert "What the lag costs" in page and "Err_energy" in page


def test_numbers_that_there_are_none_of_are_null(command: Command, work: Path) -> None:
    arguments = ("--road", "bump", "--duration", "1", "--sample", "0.005", "--steps", "6", "--control", "passive-low")
    code, said = command("quarter-car", "--fit", "plain", "--unsprung", "0", *arguments, "--no-check", "--json")
    assert code == 0
    content = page_of(work, "quarter-car")[1]
    row = content["rows"][0]
    assert "passive-low" in page_of(work, "quarter-car")[0] and "Desired damping" not in page_of(work, "quarter-car")[0]
    assert row["tyre_load"] is None and row["least_load"] is None and row["chatter"]["first"] is None
    assert content["amplifier"]["rate"] is None and content["timing"]["until"] is None
    told = json.loads(said)
    places = {name: told.pop(name) for name in ("page", "file")}
    assert told == content and all(Path(place).is_file() for place in places.values())


@pytest.mark.slow
def test_quarter_car_writes_rides_with_their_seeds(command: Command, work: Path) -> None:
    arguments = ("quarter-car", "--fit", "lagging", "--road", "C", "--duration", "2", "--seed", "7", "--no-check")
    timing = ("--sample", "0.005", "--steps", "6", "--control", "passive-low,hybrid")
    code, said = command(*arguments, *timing)
    assert code == 0 and "passive-low" in said
    page, content = page_of(work, "quarter-car")
    rows, roads = content["rows"], content["roads"]
    assert isinstance(rows, list) and len(rows) == 2 * 2
    assert isinstance(roads, list) and roads[0]["seed"] == 7 and "seed 7" in page
    assert "hybrid 2000 N·s/m" in page
    again = work / "apply" / "quarter-car.json"
    before = again.read_bytes()
    command(*arguments, *timing)
    assert again.read_bytes() == before, "the same command gives the same bytes"


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (("invert", "--fit", "no-current", "--sine", "1:0.01", "--law", "c=1"), 1, "does not depend on current"),
        (("invert", "--fit", "several", "--sine", "1:0.01", "--law", "c=1"), 1, "2 sets of parameters"),
        (("invert", "--fit", "nobody", "--sine", "1:0.01", "--law", "c=1"), 1, "no fit named 'nobody'"),
        (("invert", "--fit", "plain", "--law", "c=1"), 2, "give logs whose motion to take"),
        (("invert", "--fit", "plain", "--sine", "1", "--law", "c=1"), 2, "--sine takes HZ:M"),
        (("invert", "--fit", "plain", "--sine", "1:0.01"), 1, "give a law (--law) or a file (--desired)"),
        (("invert", "--fit", "plain", "--sine", "1:0.01", "--law", "x=1"), 2, "--law takes"),
        (("invert", "--fit", "plain", "--sine", "1:0.01", "--law", "c=1", "--voltage", "5"), 2, "add --inductance"),
        (("invert", "--fit", "plain", "--sine", "1:0.01", "--law", "c=1,c=2"), 2, "--law takes"),
        (("invert", "--fit", "plain", "--sine", "1:0.01", "--law", "c=1e308"), 2, "--law takes"),
        (("invert", "--fit", "plain", "a.csv", "--sine", "1:0.01"), 2, "not both"),
        (("track", "--fit", "plain", "--sine", "1:0.01"), 2, "give a desired force"),
        (("track", "--fit", "plain", "--sine", "1:0.01", "--law", "c=1", "--scheme", ","), 2, "--scheme takes"),
        (("track", "--fit", "plain", "--sine", "1:0.01", "--law", "c=1", "--scheme", "luck"), 2, "--scheme takes"),
        (("quarter-car", "--fit", "plain", "--road", "moon"), 2, "--road takes"),
        (("quarter-car", "--fit", "plain", "--control", "luck"), 2, "--control takes"),
        (("quarter-car", "--fit", "plain", "--road", ""), 2, "--road takes"),
        (("quarter-car", "--fit", "plain", "--sprung", "-1"), 2, "--sprung takes a number above 0, not -1"),
        (("quarter-car", "--fit", "plain", "--sprung", "inf"), 2, "--sprung takes a finite number, not inf"),
        (("quarter-car", "--fit", "plain", "--damping", "inf"), 2, "--damping takes a finite number, not inf"),
        (("invert", "--fit", "plain", "--sine", "1:0.01", "--dt", "nan"), 2, "--dt"),
        (("flux-command", "--fit", "coil", "--resistance", "2"), 2, "give a wanted flux"),
        (("flux-command", "--fit", "coil", "--resistance", "2", "--sine", "5"), 2, "--sine takes HZ:WB"),
        (("flux-command", "--fit", "coil", "--resistance", "2", "--sine", "5:0"), 2, "above 0, not '5:0'"),
        (("flux-command", "--fit", "coil", "--resistance", "2", "--sine", "500:0.01"), 2, "cannot be sampled"),
        (("flux-command", "--fit", "coil", "--sine", "5:0.01"), 2, "--resistance"),
        (("flux-command", "--fit", "plain", "--resistance", "2", "--sine", "5:0.01"), 1, "predicts force: fit a coil"),
        (("flux-command", "--fit", "coil", "--plant", "nobody", "--resistance", "2", "--sine", "5:0.01"), 1, "no fit"),
        (("invert", "--fit", "coil", "--sine", "1:0.01", "--law", "c=1"), 1, "predicts flux"),
    ],
)
def test_what_cannot_be_done_is_said_in_one_line(
    arguments: tuple[str, ...], code: int, words: str, command: Command, work: Path
) -> None:
    found, text = command(*arguments)
    assert found == code and words in text
    assert not (work / "apply").exists(), "the workspace is unchanged"


def write_coil_log(path: Path, samples: int = 1000) -> tuple[np.ndarray, np.ndarray]:
    """Write a coil's current and flux, measured, and return them."""
    from mrfit.simulate.assembly import assemble

    t = np.arange(samples) * 1e-3
    current = 2.0 * np.sin(2 * np.pi * 5.0 * t) * (1.0 + 0.5 * np.sin(2 * np.pi * 0.7 * t))
    whole = assemble("boucwen-flux")
    flux = whole.simulate(current[None], whole.spec.theta(COIL)[None], 1e-3)[0]
    np.savetxt(path, np.c_[t, current, flux], "%.12g", ",", header="time [s],current [A],flux [Wb]", comments="")
    return current, flux


def test_the_current_of_a_logged_flux_is_the_logged_one(command: Command, work: Path, tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    current, _ = write_coil_log(log)
    code, said = command("current", "--fit", "coil", log, "--known", "0.1", "--json")
    assert code == 0, said
    row = json.loads(said)["logs"][0]
    assert row["known"] == 100 and row["error"] < 1e-6
    page, content = page_of(work, "current")
    assert content["coil"]["model"] == "boucwen-flux" and "known for the first 0.1 s" in page
    assert "flux model inverted" in page and ">known (s)<" in page and "gives it directly" not in page
    from pyarrow.parquet import read_table

    table = read_table(work / "apply" / "current-1.parquet").to_pydict()
    np.testing.assert_allclose(table["current"], current, atol=1e-6)
    write_fit(work, "mmf", Damper("mmf", "boucwen-mmf", MMF, (), 0.0, 1.0))
    assert command("current", "--fit", "mmf", log)[0] == 0
    assert "gives it directly" in page_of(work, "current")[0] and "inverted" not in page_of(work, "current")[0]
    assert command("current", "--fit", "coil", log)[0] == 0
    code, text = command("current", "--fit", "coil", log, "--known", "0.001")
    assert code == 1 and "is 1 of its 1000 samples" in text
    assert command("current", "--fit", "coil", log, "--known", "1")[0] == 1
    bare = tmp_path / "bare.csv"
    bare.write_text("time [s],force [N]\n" + "".join(f"{k / 100},{k % 7}\n" for k in range(200)))
    code, text = command("current", "--fit", "coil", bare)
    assert code == 1 and "bare.csv: no flux linkage" in text


def test_the_voltage_for_a_flux_and_its_limits(command: Command, work: Path, tmp_path: Path) -> None:
    wanted = ("flux-command", "--fit", "coil", "--resistance", "2.1")
    code, said = command(*wanted, "--sine", "5:0.03", "--voltage", "20", "--json")
    assert code == 0 and json.loads(said)["error"] < 1e-9
    page, content = page_of(work, "flux-command")
    assert "20 V: the limit never binds." in page and content["limited"] == 0.0
    assert "The plant is the model itself" in page and content["wanted"] == "Sine of 5 Hz and 0.03 Wb"
    write_fit(work, "other", Damper("other", "boucwen-flux", tuple({**COIL, "Lc": 0.03}.items()), (), 0.0, 1.0))
    assert command(*wanted, "--sine", "5:0.03", "--plant", "other")[0] == 0
    assert "The plant is the model itself" not in page_of(work, "flux-command")[0]
    assert [percent_text(share) for share in (0.0, 2.9e-14, 0.003)] == ["0 %", "less than 10⁻⁹ %", "0.3 %"]
    assert command(*wanted, "--sine", "5:0.03", "--voltage", "3", "--current", "1")[0] == 0
    page, content = page_of(work, "flux-command")
    assert content["limited"] > 0.1 and content["greatest_voltage"] <= 3.0 and content["greatest_current"] <= 1.0 + 1e-9
    assert "1 A: at the limit in" in page and "Red:" in page
    log = tmp_path / "log.csv"
    _, flux = write_coil_log(log)
    code, said = command(*wanted, "--desired", log, "--json")
    assert code == 0 and json.loads(said)["samples"] == len(flux)


def test_the_same_from_python(work: Path) -> None:
    fit = mrfit.load(work / "fits" / "plain" / "fit.json")
    motion = mrfit.apply.sine(1.0, 0.01, 0.5)
    found = mrfit.apply.invert(fit, motion, "c=2e4")
    assert found.summary.greatest_error_where_reached < 1e-9
    assert mrfit.apply.track(fit, motion, "c=2e4", ["feedforward"]).cases[0].error < 1e-9
    ride = mrfit.apply.quarter_car(
        fit,
        controls=[mrfit.apply.Control("passive-low")],
        roads=[mrfit.apply.road("bump", duration=1.0)],
        timing=mrfit.apply.Timing(5e-3, 5),
        check=False,
    )
    assert ride.to_frame()["acceleration"][0] > 0.0
    for shown in map(repr, (found, ride)):
        # of hundreds of samples pandas shows ten
        assert shown.count("\n") < 20 and "array(" not in shown
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        mrfit.apply.nothing  # noqa: B018
