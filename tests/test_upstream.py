"""What is changed upstream reaches every later stage; what changes nothing there makes nothing again."""

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mrfit.discover.stage
import mrfit.fit.stage
import mrfit.flux.stage
import mrfit.ingest.stage
import mrfit.report.stage
import mrfit.segment.stage
from mrfit.cli import output, pipeline
from mrfit.core.progress import silent
from mrfit.ingest.readers import delimited
from mrfit.io.keys import discovery_key, fit_key
from mrfit.io.outdated import Inputs
from mrfit.io.schemas.fit import Fit
from mrfit.io.workspace import Workspace

UNITS = {
    "force": ("N", "kN"),
    "torque": ("N*m", "mN*m"),
    "displacement": ("m", "mm"),
    "angle": ("rad", "deg"),
    "velocity": ("m/s", "mm/s"),
    "angular_velocity": ("rad/s", "deg/s"),
    "acceleration": ("m/s^2", "mm/s^2"),
    "angular_acceleration": ("rad/s^2", "deg/s^2"),
    "current": ("A", "mA"),
    "voltage": ("V", "mV"),
    "flux": ("Wb", "mWb"),
    "temperature": ("degC", "K"),
    "pressure": ("bar", "Pa"),
}
EDITS = ("unit", "scale", "offset", "sign")
RATE, CYCLES, FREQUENCY, RESISTANCE = 200, 8, 2.0, 3.0


@dataclass
class Study:
    """Logs with a channel map, and the workspace they are read into."""

    logs: Path
    work: Path

    def map(self, changed: dict[str, dict[str, object]], more: str = "") -> None:
        """Write the channel map, with other rules for some of the channels."""
        rules = {c: {"column": c, "unit": u, **changed.get(c, {})} for c, (u, _) in UNITS.items() if c in self.channels}
        lines = [f"{c} = {{{', '.join(f'{k} = {json.dumps(v)}' for k, v in r.items())}}}" for c, r in rules.items()]
        (self.logs / "mrfit.toml").write_text("\n".join([more, "[channels]", *lines]) + "\n")

    @property
    def channels(self) -> list[str]:
        return (next(self.logs.glob("*.csv"))).read_text().partition("\n")[0].split(",")

    def ingest(self) -> dict[str, Any]:
        return pipeline.ingest(self.work, [self.logs], mrfit.ingest.stage.Settings(), silent)

    def cut(self) -> tuple[bool, bool, bool]:
        """Run ingest, flux and segment; return which of them had nothing to do."""
        read = self.ingest()
        flux = pipeline.flux(self.work, mrfit.flux.stage.Settings(resistance=RESISTANCE), silent)
        return read["skipped"], flux["skipped"], pipeline.segment(self.work, HELD, silent)["skipped"]

    def keys(self) -> tuple[str, str]:
        """Return the keys a fit and a discovery would have now."""
        workspace = Workspace(self.work)
        here = workspace.made_from(workspace.read_segments())
        return fit_key({"model": "bingham"}, *here), discovery_key({"model": "bingham"}, *here)

    @staticmethod
    def fit(key: str) -> Fit:
        made = {"name": "x", "model": "bingham", "optimizer": "auto", "output": "force", "results": [], "metrics": []}
        return Fit(**made, key=key, settings={"model": "bingham"})

    def outdated(self, key: str) -> list[str]:
        return list(Inputs(Workspace(self.work)).of_fits([self.fit(key)]))


HELD = mrfit.segment.stage.Settings(holdout="none")


def log(path: Path, names: list[str], amplitude: float = 1.0) -> None:
    """A log of sines, each channel with a size and a phase of its own; voltage is what its coil needs."""
    time = np.arange(RATE * CYCLES) / (RATE * FREQUENCY)
    turn = 2 * np.pi * FREQUENCY * time
    columns = {n: amplitude * (1.0 + k) * np.sin(turn + 0.3 * k) for k, n in enumerate(names)}
    if "temperature" in columns:
        columns["temperature"] = 20.0 + 0.01 * columns["temperature"]
    text = ["time," + ",".join(names)]
    text += [",".join(f"{v:.9g}" for v in row) for row in zip(time, *columns.values(), strict=True)]
    path.write_text("\n".join(text) + "\n")


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    """A workspace, ingested, with flux and segments, of two logs of every channel there is but flux."""
    folder = tmp_path_factory.mktemp("upstream")
    (folder / "logs").mkdir()
    for k in (1, 2):
        log(folder / "logs" / f"t{k}.csv", [n for n in UNITS if n != "flux"], float(k))
    made = Study(folder / "logs", folder / "w")
    made.map({})
    made.cut()
    return made


def edited(channel: str, edit: str) -> dict[str, dict[str, object]]:
    value = {"unit": UNITS[channel][1], "scale": 10.0, "offset": 0.5, "sign": -1}[edit]
    return {channel: {edit: value}}


# every edit of one channel, one edit of every channel; the others are slow
CELLS = [
    pytest.param(channel, edit, marks=[pytest.mark.slow] * (channel != "displacement" and edit != "scale"))
    for channel in UNITS
    if channel != "flux"
    for edit in EDITS
]


@pytest.mark.parametrize(("channel", "edit"), CELLS)
def test_an_edited_channel_map_makes_every_later_stage_anew(channel: str, edit: str, study: Study) -> None:
    study.map({})
    study.cut()
    before = study.keys()
    assert study.cut() == (True, True, True)
    assert study.outdated(before[0]) == []
    study.map(edited(channel, edit))
    assert not study.ingest()["skipped"]
    # before flux and segment have run again, a fit is of other data than those now read
    assert study.outdated(before[0]) == ["x"]
    assert study.cut() == (True, False, False)
    after = study.keys()
    assert before[0] != after[0] and before[1] != after[1]
    assert study.outdated(before[0]) == ["x"] and study.outdated(after[0]) == []
    study.map({})
    study.cut()
    assert study.keys() == before


@pytest.mark.parametrize("edit", EDITS)
def test_an_edited_map_of_a_measured_flux_reaches_the_fit(edit: str, tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir()
    log(tmp_path / "logs" / "t.csv", ["current", "flux"])
    made = Study(tmp_path / "logs", tmp_path / "w")
    made.map({})
    made.cut()
    before = made.keys()
    made.map(edited("flux", edit))
    assert made.cut() == (False, False, False)
    assert made.keys() != before


@pytest.mark.parametrize(
    ("changed", "more"),
    [
        ({}, "[condition]\ntemperature = 40.0"),
        ({"velocity": {"column": "acceleration"}, "acceleration": {"column": "velocity"}}, ""),
        ({}, 'time = {column = "time", unit = "ms"}'),
    ],
    ids=["condition", "columns exchanged", "unit of time"],
)
def test_another_condition_column_or_time_makes_every_later_stage_anew(
    changed: dict[str, dict[str, object]], more: str, study: Study
) -> None:
    study.map({})
    study.cut()
    before = study.keys()
    study.map(changed, more)
    assert study.cut() == (False, False, False)
    assert study.keys() != before


@pytest.mark.parametrize("more", ["# a comment", "ignore = ['no such column']"])
def test_an_edit_that_changes_no_content_makes_nothing_anew_but_what_is_read(more: str, study: Study) -> None:
    study.map({})
    study.cut()
    before, written = study.keys(), (study.work / "segments.parquet").stat().st_mtime_ns
    study.map({}, more)
    assert study.cut() == ("#" in more, True, True)
    assert study.keys() == before and study.outdated(before[0]) == []
    assert (study.work / "segments.parquet").stat().st_mtime_ns == written


def test_another_version_of_a_reader_reaches_the_fit_where_it_reads_other_numbers(
    study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    factor, version, read = 1.0, "1", delimited.read

    def other(source: Any) -> Any:
        def told(column: Any) -> Any:
            return replace(column, values=column.values * (factor if column.name == "force" else 1.0))

        return [replace(t, columns=tuple(told(c) for c in t.columns)) for t in read(source)]

    monkeypatch.setattr(delimited, "read", other)
    monkeypatch.setattr("mrfit.io.keys.code_version", lambda stage="": stage + version * (stage == "ingest"))
    study.map({})
    study.cut()
    before, version = study.keys(), "2"
    assert study.cut() == (False, True, True)
    assert study.keys() == before
    version, factor = "3", 2.0
    assert study.cut() == (False, False, False)
    assert study.keys() != before


def run(tmp_path: Path, fit: str) -> dict[str, Any]:
    from mrfit.cli.config import read_pipeline

    (tmp_path / "p.toml").write_text(f'[ingest]\nlogs = ["logs/*.csv"]\n[segment]\nholdout = "none"\n{fit}')
    return pipeline.run(read_pipeline(tmp_path / "p.toml"), tmp_path, pipeline.Overrides(None, tmp_path / "w"), silent)


def test_a_unit_mended_in_the_map_gives_other_parameters(tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir()
    made = Study(tmp_path / "logs", tmp_path / "w")
    time = np.arange(RATE * CYCLES) / (RATE * FREQUENCY)
    velocity = np.cos(2 * np.pi * FREQUENCY * time)
    rows = zip(time, np.sin(2 * np.pi * FREQUENCY * time) / (2 * np.pi * FREQUENCY), 7.0 * velocity, strict=True)
    text = "\n".join(",".join(f"{v:.9g}" for v in row) for row in rows)
    (made.logs / "t.csv").write_text(f"time,displacement,force\n{text}\n")
    made.map({})
    stages = '[[fit]]\nmodel = "polynomial"\nopt = "lsq"\nper = "all"\n[discover]\nmodel = "polynomial"\n'
    first = run(tmp_path, stages)
    again = run(tmp_path, stages)
    assert again["fits"][0]["skipped"] and again["discovery"]["skipped"] and again["report"]["skipped"]
    assert not pipeline.advise(made.work)["outdated"]
    made.map({"force": {"unit": "kN"}})
    made.ingest()
    assert pipeline.report(made.work, mrfit.report.stage.Settings(), silent)["outdated"] == ["polynomial.lsq.all"]
    assert pipeline.advise(made.work)["outdated"]
    second = run(tmp_path, stages)
    assert not second["fits"][0]["skipped"] and not second["discovery"]["skipped"]
    assert second["report"]["outdated"] == [] and not pipeline.advise(made.work)["outdated"]

    def slope(found: dict[str, Any]) -> float:
        return {p["name"]: p["value"] for p in found["fits"][0]["results"][0]["parameters"]}["a1"]

    assert slope(second) == pytest.approx(1000.0 * slope(first), rel=1e-6)


def test_a_resistance_given_with_a_fit_is_said_to_stay(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "logs").mkdir()
    log(tmp_path / "logs" / "t.csv", ["current", "voltage"])
    made = Study(tmp_path / "logs", tmp_path / "w")
    made.map({}, "resistance = 2.0")
    made.ingest()
    settings = mrfit.fit.stage.Settings("boucwen-flux", "lsq", per="all", budget=20, seconds=0.5)

    def said(resistance: float | None) -> str:
        output.fit(pipeline.fit(made.work, settings, resistance, silent), made.work)
        return "".join(line for line in capsys.readouterr().out.splitlines() if "coil resistance" in line)

    pipeline.segment(made.work, HELD, silent)
    assert said(None) == ""
    assert (
        said(2.5).strip() == "coil resistance 2.5 Ω, kept for later commands of this workspace; `mrfit flux` changes it"
    )
    assert said(None).strip().startswith("coil resistance 2.5 Ω, set by an earlier command of this workspace;")
    pipeline.flux(made.work, mrfit.flux.stage.Settings(), silent)
    assert said(None) == ""
    assert Workspace(made.work).read_recording("t", "flux").condition["flux_resistance"] == 2.0
