"""Fits of a driven mass: planted parameters come back, and wrong input is one line."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mrfit
from mrfit.core.recording import Recording, Segment
from mrfit.errors import ConfigError, DataError
from mrfit.fit.driven import at_tolerance, with_drive, within_noise
from mrfit.fit.driven import tests_of_law as made_tests
from mrfit.fit.identify import build_group
from mrfit.fit.stage import FitOrigin, identify
from mrfit.io.dataset import Dataset
from mrfit.search.cube import cube_of
from mrfit.search.problem import LeastSquaresProblem
from mrfit.segment.detect import detect
from mrfit.settings.fit import Settings
from mrfit.simulate.assembly import assemble
from tests import commands

DT, PERIOD = 2e-3, 500
TRUTH = {"k": 8000.0, "c": 12.0, "f0": 0.0, "mass": 2.0}
NOISE = 1e-5


def log(channel: str, cycles: int, noise: float, output: str = "displacement") -> tuple[Recording, Segment]:
    rng = np.random.default_rng(3)
    phase = 2 * np.pi * np.arange(PERIOD) / PERIOD
    lines = range(3, 40)
    cycle = sum(4.0 * np.cos(n * phase + p) for n, p in zip(lines, rng.uniform(0, 2 * np.pi, len(lines)), strict=True))
    drive = np.resize(cycle, PERIOD * max(cycles, 1))
    by = "force" if channel == "excitation_force" else "base"
    whole = assemble(f"linear-spring-dashpot@{by}-{output.replace('_', '-')}")
    lead = 3 * PERIOD if cycles else 0
    motion = whole.simulate(np.resize(cycle, lead + len(drive))[None], whole.spec.theta(TRUTH)[None], DT)[0, lead:]
    motion = motion + noise * rng.standard_normal(len(motion))
    units = {channel: "N", output: "m"}
    recording = Recording("r", "r.csv", "", "", DT, 0.0, {channel: drive, output: motion}, units)
    (segment,) = detect(recording, channel, 3, 1, 0.1).segments
    return recording, replace(segment, condition="planted")


def fitted(recording: Recording, segment: Segment, settings: Settings):
    return identify(Dataset([segment], {"r": recording}), settings, FitOrigin("", "", "")).content


def test_planted_mass_spring_and_dashpot_lie_in_their_intervals() -> None:
    recording, segment = log("excitation_force", 4, NOISE)
    assert segment.cycles == 4
    fit = fitted(recording, segment, Settings("linear-spring-dashpot", driven_by="force", mass="free"))
    assert fit.model == "linear-spring-dashpot@force-displacement"
    for found in fit.results[0].parameters:
        assert found.low <= TRUTH[found.name] <= found.high or found.value == pytest.approx(TRUTH[found.name], rel=2e-3)
    assert fit.pooled("train").rmse == pytest.approx(NOISE, rel=0.05)


def test_cycles_are_one_mean_cycle_and_the_solver_errs_less_than_the_noise_by_far() -> None:
    recording, segment = log("excitation_force", 4, NOISE)
    whole = assemble("linear-spring-dashpot@force-displacement")
    group = build_group("all", [segment], {"r": recording}, whole, False)
    (block,) = group.search
    measured = recording.channels["displacement"].reshape(4, PERIOD)
    assert block.target == pytest.approx(measured.mean(axis=0))
    assert block.scatter == pytest.approx(4 * PERIOD * np.mean(np.var(measured, axis=0)))
    cube = cube_of(whole.spec, {}, {}, {})
    posed = LeastSquaresProblem(group.search, np.ones(1), whole, cube)
    point = cube.to_points(whole.spec.theta(TRUTH)[None])
    rough, exact = (within_noise(posed, point).residuals(point)[0], at_tolerance(posed, 1e-9).residuals(point)[0])
    assert np.sqrt(np.mean(exact**2)) == pytest.approx(NOISE, rel=0.05)
    assert 0.0 < np.sqrt(np.mean((rough - exact) ** 2)) < 0.015 * NOISE


def test_record_of_a_base_from_rest_gives_what_a_known_mass_hangs_on() -> None:
    recording, segment = log("base_acceleration", 0, 0.0, "acceleration")
    assert segment.cycles == 0
    fit = fitted(recording, segment, Settings("linear-spring-dashpot", driven_by="base", mass="2.0"))
    found = {p.name: p.value for p in fit.results[0].parameters}
    assert found == pytest.approx(TRUTH, rel=1e-4, abs=1e-3)


@pytest.mark.parametrize(
    ("settings", "error", "text"),
    [
        ({"driven_by": "force"}, ConfigError, "a mass is driven, and none is given"),
        ({"driven_by": "force", "mass": "two"}, ConfigError, "--mass two is no mass"),
        ({"mass": "2.0"}, ConfigError, "add --driven-by force or base"),
    ],
)
def test_mass_and_drive_that_do_not_go_together_are_refused(settings, error, text) -> None:
    recording, _ = log("excitation_force", 1, 0.0)
    with pytest.raises(error, match=text):
        with_drive(Settings("bingham", **settings), {"r": recording})


def test_two_excitations_and_one_that_aliases_are_refused() -> None:
    recording, _ = log("excitation_force", 1, 0.0)
    asked = Settings("bingham", driven_by="force", mass="free")
    both = replace(recording, channels={**recording.channels, "base_acceleration": recording.channels["displacement"]})
    with pytest.raises(DataError, match="holds excitation_force and base_acceleration"):
        with_drive(asked, {"r": both})
    white = np.random.default_rng(0).standard_normal(PERIOD)
    with pytest.raises(DataError, match="of the excitation's power lies above 0.43 of the sampling rate"):
        with_drive(asked, {"r": replace(recording, channels={**recording.channels, "excitation_force": white})})


def test_force_at_rest_is_sought_near_the_forces_that_drive() -> None:
    recording, _ = log("base_acceleration", 1, 0.0)
    most = 2.0 * float(np.abs(recording.channels["base_acceleration"]).max())
    made = with_drive(Settings("bingham", driven_by="base", mass="2.0"), {"r": recording})
    assert dict((n, (low, high)) for n, low, high in made.bounds) == {"f0": pytest.approx((-10.0 * most, 10.0 * most))}
    own = (("f0", -5.0, 5.0),)
    assert with_drive(Settings("bingham", driven_by="base", mass="2.0", bounds=own), {"r": recording}).bounds == own


@pytest.mark.parametrize(("channel", "mass"), [("excitation_force", "free"), ("base_acceleration", "2.0")])
def test_what_excitation_and_inertia_leave_is_the_force_of_the_law(channel: str, mass: str) -> None:
    recording, segment = log(channel, 4, 0.0)
    drive = "force" if mass == "free" else "base"
    made = made_tests(Dataset([segment], {"r": recording}), drive, mass)
    (moved,), test = made.segments, made.recordings["r"].channels
    assert (moved.drive, moved.cycles, moved.warm_up, moved.start) == ("displacement", 3, PERIOD, PERIOD)
    assert moved.amplitude == pytest.approx(0.5 * np.ptp(test["displacement"]))
    assert channel not in test
    expected = TRUTH["k"] * test["displacement"] + TRUTH["c"] * test["velocity"]
    assert np.abs(test["force"] - expected).max() < 1e-4 * np.ptp(expected)


def test_a_mass_on_its_base_is_needed_for_the_force_of_the_law() -> None:
    recording, segment = log("base_acceleration", 4, 0.0)
    with pytest.raises(ConfigError, match="only the force over the mass is known"):
        made_tests(Dataset([segment], {"r": recording}), "base", "free")
    with pytest.raises(DataError, match="no excitation_force in this log"):
        made_tests(Dataset([segment], {"r": recording}), "force", "free")


def test_driven_mass_by_the_library_is_that_by_commands_and_on_the_page(tmp_path: Path) -> None:
    recording, _ = log("excitation_force", 0, NOISE)
    columns = [recording.channels[n] for n in ("excitation_force", "displacement")]
    own = mrfit.Recording.from_arrays(dt=DT, excitation_force=columns[0], displacement=columns[1])
    fit = mrfit.fit(own, "linear-spring-dashpot", driven_by="force", mass="free", holdout="none", progress=False)
    low, high = fit.params.loc["mass", ["low", "high"]]
    assert low <= TRUTH["mass"] <= high
    rows = np.column_stack([np.arange(len(columns[0])) * DT, *columns])
    header = "time_s,excitation_force_N,displacement_m"
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header=header, comments="", fmt="%.17g")
    for line in ("ingest log.csv", "fit --model linear-spring-dashpot --driven-by force --mass free", "report"):
        done = commands.text(tmp_path, *line.split())
        assert done.returncode == 0, done.stderr
    page = (tmp_path / "mrfit-work/report/index.html").read_text(encoding="utf-8")
    assert "mass that the excitation moves" in page
    table = (tmp_path / "mrfit-work/report/parameters.csv").read_text(encoding="utf-8")
    (row,) = [r for r in table.splitlines() if ",mass," in r]
    assert f"{fit.params.loc['mass', 'value']:.4g}"[:5] in row
