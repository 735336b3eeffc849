"""Fits of a driven mass: planted parameters come back, and wrong input is one line."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mrfit
from mrfit.core.recording import Recording, Segment
from mrfit.errors import ConfigError, DataError
from mrfit.fit.driven import _by_polynomials, _by_series, _mass_of, at_tolerance, with_drive, within_noise
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
NAN = float("nan")


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


def test_parts_of_one_record_are_tests_of_the_law_at_their_places() -> None:
    recording, whole = log("excitation_force", 0, 0.0)
    assert whole.cycles == 0
    before = replace(whole, id="r#1", stop=300)
    after = replace(whole, id="r#2", start=300, warm_up=300, role="holdout")
    made = made_tests(Dataset([before, after], {"r": recording}), "force", "free")
    assert [(s.start, s.stop, s.warm_up) for s in made.segments] == [(0, 300, 0), (300, whole.stop, 300)]
    (alone,) = made_tests(Dataset([whole], {"r": recording}), "force", "free").recordings.values()
    for name, values in alone.channels.items():
        np.testing.assert_allclose(made.recordings["r"].channels[name], values, rtol=1e-6)


@pytest.mark.parametrize(("cut", "told"), [(0, False), (130, True)])
def test_a_record_that_begins_in_motion_is_told(cut: int, told: bool) -> None:
    recording, whole = log("excitation_force", 0, NOISE)
    kept = {name: values[cut:] for name, values in recording.channels.items()}
    fit = fitted(
        replace(recording, channels=kept),
        replace(whole, stop=whole.stop - cut),
        Settings("linear-spring-dashpot", driven_by="force", mass="free"),
    )
    texts = [w.text for w in fit.results[0].warnings if w.kind == "moving-start"]
    assert len(texts) == told and (not told or "the mass moves as the record begins in r (" in texts[0])


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


def lines(order: int, at: float = 0.0) -> tuple[np.ndarray, ...]:
    """Displacement, velocity and acceleration of a cycle of two lines about a mean, and what of it has an order."""
    phase = 2 * np.pi * np.arange(PERIOD) / PERIOD
    rate = 2 * np.pi / (PERIOD * DT)
    motion = [
        at + np.sin(3 * phase) + 0.2 * np.cos(7 * phase),
        rate * (3 * np.cos(3 * phase) - 1.4 * np.sin(7 * phase)),
        -(rate**2) * (9 * np.sin(3 * phase) + 9.8 * np.cos(7 * phase)),
    ]
    return (*motion, motion[min(order, 2)])


@pytest.mark.parametrize("order", [0, 1, 2])
def test_motion_of_a_cycle_is_its_series_whatever_of_it_was_logged(order: int) -> None:
    *motion, logged = lines(order, at=0.5)
    excitation = logged - logged.mean()
    found = _by_series(logged, excitation, order, DT)
    # the mean is known of a displacement alone
    expected = [motion[0] - 0.5 * (order > 0), *motion[1:]]
    for own, true in zip(found, expected, strict=True):
        assert np.abs(own - true).max() < 1e-9 * np.ptp(true)


def test_what_lies_beyond_the_excitation_is_noise_and_the_base_is_no_motion_of_the_mass() -> None:
    *motion, logged = lines(2)
    phase = 2 * np.pi * np.arange(PERIOD) / PERIOD
    excitation = np.cos(3 * phase) + 0.02 * np.sin(7 * phase) + 0.005 * np.cos(90 * phase)
    noisy = logged + 1e3 * np.cos(90 * phase)
    assert _by_series(noisy, excitation, 2, DT)[2] == pytest.approx(motion[2], abs=1e-6 * np.ptp(motion[2]))
    # an absolute acceleration is the mass's own beside that of the base
    base = 5.0 * np.cos(7 * phase)
    absolute = _by_series(logged + base, base, 3, DT)
    assert absolute[0] == pytest.approx(motion[0], abs=1e-9)


def test_motion_of_a_random_record_is_without_what_integrals_add_of_their_own() -> None:
    time = np.arange(4000) * DT
    x = 0.01 * np.sin(2 * np.pi * 1.5 * time) * np.hanning(4000)
    drift = np.gradient(np.gradient(x, DT), DT) + 0.3
    recording = Recording("r", "r.csv", "", "", DT, 0.0, {"acceleration": drift, "excitation_force": x}, {})
    segment = Segment("r#1", "a", "r", 0, 4000, 0, "random", "excitation_force", 0.0, 1.0, 0.0, 0, NAN, NAN, "train")
    found = _by_polynomials(segment, recording, 2)
    assert np.abs(found[0] - x).max() < 0.05 * np.ptp(x)
    assert np.corrcoef(found[1], np.gradient(x, DT))[0, 1] > 0.99
    # beside the base that drives it the mass's own acceleration is what differs
    base = np.sin(6 * np.pi * time)
    both = replace(recording, channels={"absolute_acceleration": drift + base, "base_acceleration": base, "force": x})
    beside = _by_polynomials(replace(segment, drive="base_acceleration"), both, 3)
    assert beside[0] == pytest.approx(found[0], abs=1e-9)


@pytest.mark.parametrize("phase", [0.0, 1.0, 2.5])
def test_the_parabola_of_two_integrals_is_taken_off_at_once(phase: float) -> None:
    time, speed = DT * np.arange(16000), 3 * np.pi
    x, v = 0.01 * np.cos(speed * time + phase), -0.01 * speed * np.sin(speed * time + phase)
    logged = {"acceleration": 0.7 - speed**2 * x, "excitation_force": x}
    recording = Recording("r", "r.csv", "", "", DT, 0.0, logged, {})
    segment = Segment("r#1", "a", "r", 0, 16000, 0, "random", "excitation_force", 0.0, 1.0, 0.0, 0, NAN, NAN, "train")
    found = _by_polynomials(segment, recording, 2)
    # what a cosine of 48 cycles has of a parabola is a share of 1/48 of it
    assert np.abs(found[0] - x).max() < np.ptp(x) / 48
    assert np.abs(found[1] - v).max() < np.ptp(v) / 48 / 10


@pytest.mark.parametrize("text", ["0", "-1", "inf", "nan", "two"])
def test_what_is_no_mass_is_refused(text: str) -> None:
    with pytest.raises(ConfigError, match=f"--mass {text} is no mass: give it in kg"):
        _mass_of(text)
    assert _mass_of("1e-3") == 1e-3


def test_the_motion_that_all_logs_have_is_predicted_and_what_the_user_says_stays() -> None:
    first, _ = log("excitation_force", 1, 0.0)
    second = replace(first, id="s", channels={**first.channels, "acceleration": first.channels["displacement"]})
    third = replace(second, id="t", channels={n: v for n, v in second.channels.items() if n != "displacement"})
    asked = Settings("bingham", driven_by="force", mass="2.5", fixed=(("fy", 3.0),))
    made = with_drive(asked, {"r": first, "s": second})
    assert made.model == "bingham@force-displacement" and made.fixed == (("fy", 3.0), ("mass", 2.5))
    assert (made.name, made.current_order) == ("bingham.auto", "0")
    assert with_drive(asked, {"s": second, "t": third}).model == "bingham@force-acceleration"
    free = with_drive(replace(asked, mass="free", current_order="fy=1", name="own"), {"r": first})
    assert (free.fixed, free.current_order, free.name) == (asked.fixed, "fy=1", "own")
    # a log without excitation says nothing of the motion
    bare = replace(third, id="u", channels={"acceleration": third.channels["acceleration"]})
    assert with_drive(asked, {"s": second, "u": bare}).model == "bingham@force-displacement"


@pytest.mark.parametrize(("order", "refused"), [(200, False), (240, True)])
def test_an_excitation_is_refused_whose_power_lies_near_half_the_sampling_rate(order: int, refused: bool) -> None:
    phase = 2 * np.pi * np.arange(PERIOD) / PERIOD
    recording, _ = log("excitation_force", 1, 0.0)
    values = np.cos(order * phase) * 0.3 + np.cos(5 * phase)
    own = replace(recording, channels={**recording.channels, "excitation_force": values})
    asked = Settings("bingham", driven_by="force", mass="free")
    if refused:
        with pytest.raises(DataError, match="8 % of the excitation's power lies above 0.43"):
            with_drive(asked, {"r": own})
    else:
        assert with_drive(asked, {"r": own}).model.startswith("bingham@")
