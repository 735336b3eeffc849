"""Parameters along a log: Kalman's filter where the law is linear, planted changes, standing still, the batch fit."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.errors import ConfigError
from mrfit.export.tracker import plan_of
from mrfit.io.schemas.fit import Covariance
from mrfit.kernels.tracking import begun_estimator, corrected
from mrfit.track.run import ParameterTrack, track_log
from tests.export.rigs import rig
from tests.track.logs import DT, NOISE, SHARE, VALUES, columns, fitted, force, motion

TRACKED = ("fy", "c", "f0")
Oracle = Callable[[Array, Array, Array, Array, float], tuple[Array, Array]]


def tracked(measured: Array, channels: dict[str, Array], names: tuple[str, ...] = TRACKED) -> ParameterTrack:
    source = fitted()
    return track_log(source, plan_of(source, names), channels, measured, DT)


def test_the_plan_is_what_fit_and_logs_say() -> None:
    plan = plan_of(fitted(), TRACKED)
    assert [p.deviation for p in plan.parameters] == pytest.approx([SHARE * VALUES[n] for n in TRACKED], rel=1e-6)
    assert plan.deviation == pytest.approx(NOISE, rel=0.05) and plan.correlated == pytest.approx(DT, rel=0.2)
    ((name, rate),) = plan.standing
    assert name == "velocity" and 0.0 < rate < 0.1 * np.abs(motion(4.0)["velocity"]).max()


def test_a_parameter_that_is_open_has_the_deviation_of_what_moves_with_it() -> None:
    source = rig("boucwen")
    values = dict(
        zip([q.name for q in source.spec.derived], source.assembly.derived(source.theta[None])[0], strict=True)
    )
    force, offset = 0.02 * values["yield_force"], 0.3 * abs(values["offset"])
    stored = Covariance(
        names=["yield_force", "offset"],
        roles=["", ""],
        log=[False, False],
        rows=[[force**2, 0.5 * force * offset], [0.5 * force * offset, offset**2]],
        degrees=1000.0,
    )
    results = [replace(source.content.results[0], covariance=stored)]
    plan = plan_of(replace(source, content=replace(source.content, results=results)), ("alpha", "x0", "c"))
    alpha, x0, c = (source.theta[source.spec.names.index(n)] for n in ("alpha", "x0", "c"))
    # nothing that is stored moves with c: a tenth of its size
    expected = [0.02 * alpha, 0.3 * abs(x0), 0.1 * c]
    assert [p.deviation for p in plan.parameters] == pytest.approx(expected, rel=1e-4)
    assert plan.prior[0, 1] == pytest.approx(0.5 * np.sign(alpha * values["yield_force"] * x0 * values["offset"]), 1e-3)


def test_bands_include_errors_of_parameters_that_are_held() -> None:
    source, share = fitted(), 0.6
    stored = source.content.results[0].covariance
    assert stored is not None
    rows, size = np.array(stored.rows), len(stored.names) + 1
    first, other = stored.names.index("fy"), stored.names.index("a1")
    rows[first, other] = rows[other, first] = share * np.sqrt(rows[first, first] * rows[other, other])
    # a quantity that is made of parameters is none that is held
    derived = np.zeros((size, size))
    derived[:-1, :-1] = rows
    derived[-1] = derived[:, -1] = [*rows[first], rows[first, first]]
    wider = replace(
        stored,
        names=[*stored.names, "yield"],
        roles=[*stored.roles, ""],
        log=[*stored.log, True],
        rows=derived.tolist(),
    )
    results = [replace(source.content.results[0], covariance=wider)]
    plan = plan_of(replace(source, content=replace(source.content, results=results)), ("fy",))
    whole = SHARE * VALUES["fy"]
    assert plan.parameters[0].deviation == pytest.approx(np.sqrt(1.0 - share**2) * whole, rel=1e-4)
    assert np.sqrt(plan.held[0, 0]) == pytest.approx(share * whole, rel=1e-4)


def textbook(start: Array, spread: Array, rows: Array, values: Array, variance: float) -> tuple[Array, Array]:
    """Kalman's filter of constants: means (N, T) and covariances (N, T, T)."""
    x, p, found = start.copy(), spread.copy(), list[tuple[Array, Array]]()
    for row, value in zip(rows, values, strict=True):
        gain = p @ row / (row @ p @ row + variance)
        x, p = x + gain * (value - row @ x), (np.eye(len(x)) - np.outer(gain, row)) @ p
        found.append((x, p))
    return np.array([m for m, _ in found]), np.array([c for _, c in found])


def filterpy(start: Array, spread: Array, rows: Array, values: Array, variance: float) -> tuple[Array, Array]:
    """The same by the library."""
    kalman = pytest.importorskip("filterpy.kalman").KalmanFilter(dim_x=len(start), dim_z=1)
    kalman.x, kalman.P, kalman.F = start[:, None].copy(), spread.copy(), np.eye(len(start))
    kalman.Q, kalman.R = np.zeros((len(start), len(start))), np.array([[variance]])
    found = list[tuple[Array, Array]]()
    for row, value in zip(rows, values, strict=True):
        kalman.predict()
        kalman.update(np.array([[value]]), H=row[None])
        found.append((kalman.x[:, 0].copy(), kalman.P.copy()))
    return np.array([m for m, _ in found]), np.array([c for _, c in found])


@pytest.mark.parametrize("oracle", [textbook, filterpy])
def test_constant_parameters_are_those_of_kalmans_filter(oracle: Oracle) -> None:
    channels, source = motion(3.0, 5), fitted()
    measured = force(channels, 2, fy=808.0, c=690.0)
    plan = plan_of(source, TRACKED)
    found = track_log(source, plan, channels, measured, DT)
    assert not found.chosen.any()
    rows = np.column_stack([columns(channels)[n] for n in TRACKED])
    start = np.array([VALUES[n] for n in TRACKED])
    values = measured - force(channels) + rows @ start
    spread = np.diag([p.deviation**2 for p in plan.parameters])
    used = np.flatnonzero(found.moves[1:] > 0) + 1
    variance = plan.deviation**2 * max(1.0, plan.correlated / DT)
    mean, covariance = oracle(start, spread, rows[used], values[used], variance)
    np.testing.assert_allclose(found.values[used], mean, rtol=1e-8)
    # bands reach further where another filter may be right, and never less far
    ratio = found.deviations[used] / np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    assert ratio.min() > 1.0 - 1e-5 and np.median(ratio) < 1.0 + 1e-5
    between = ~np.eye(len(TRACKED), dtype=bool)
    largest = covariance[-1].max()
    np.testing.assert_allclose(found.covariance[between], covariance[-1][between], rtol=1e-5, atol=1e-6 * largest)


@pytest.mark.parametrize(("name", "share"), [("fy", 0.05), ("fy", -0.3), ("c", 0.3), ("f0", 0.3)])
def test_a_step_is_followed_and_no_other_parameter_moves(name: str, share: float) -> None:
    channels = motion(20.0, 3)
    half = len(channels["velocity"]) // 2
    course = VALUES[name] * np.where(np.arange(2 * half) >= half, 1.0 + share, 1.0)
    moving: dict[str, Array] = {name: course}
    found = tracked(force(channels, 4, **moving), channels)
    truth = np.array([course[-1] if n == name else VALUES[n] for n in TRACKED])
    assert np.abs((found.values[-1] - truth) / found.deviations[-1]).max() < 3.0
    k = TRACKED.index(name)
    there = np.abs(found.values[half:, k] - course[-1]) < 0.1 * abs(course[-1] - course[0])
    assert np.argmax(there) * DT < {"fy": 0.3, "c": 3.0, "f0": 3.0}[name]


@pytest.mark.parametrize("name", TRACKED)
def test_no_filter_holds_what_is_past(name: str) -> None:
    plan, channels = plan_of(fitted(), TRACKED), motion(12.0, 16)
    t, k = begun_estimator(plan.prior, plan.filters), TRACKED.index(name)
    rows = np.column_stack([columns(channels)[n] for n in TRACKED]) * plan.column("deviation")
    noise = plan.deviation * np.random.default_rng(17).standard_normal(len(rows))
    change = np.zeros(len(TRACKED))
    change[k] = -0.3 * VALUES[name] / plan.column("deviation")[k]
    for n, row in enumerate(rows):
        truth = change * (n > 3 * len(rows) // 4)
        corrected(t, plan.constants, row, float(row @ (truth - t.estimate) + noise[n]), DT, 1)
    # the last filter alone stands for no change at all
    assert np.abs(t.mean[:-1, k] - change[k]).max() < 0.2 * abs(change[k])


def test_a_ramp_stays_within_the_bands() -> None:
    channels = motion(30.0, 6)
    course = VALUES["fy"] * (1.0 + 0.2 * np.clip(np.linspace(-0.5, 1.5, len(channels["velocity"])), 0.0, 1.0))
    found = tracked(force(channels, 7, fy=course), channels)
    held = np.abs(found.values[:, 0] - course) < 1.96 * found.deviations[:, 0]
    assert held.mean() > 0.85


def test_nothing_moves_while_the_damper_stands() -> None:
    channels = motion(6.0, 8)
    standing = {
        n: np.concatenate([v[:3000], np.full(9000, v[3000] * (n == "displacement")), v[3000:]])
        for n, v in channels.items()
    }
    measured = force(standing, 9)
    # what a seal creeps, a load cell drifts
    measured[3000:12000] += np.linspace(0.0, 200.0, 9000)
    found = tracked(measured, standing)
    assert np.ptp(found.values[3000:12000], axis=0).max() == 0.0
    assert np.abs((found.values[-1] - [VALUES[n] for n in TRACKED]) / found.deviations[-1]).max() < 3.0


def test_a_sample_that_is_no_number_changes_nothing() -> None:
    channels = motion(2.0, 10)
    measured = force(channels, 11)
    measured[1000:1100] = np.nan
    found = tracked(measured, channels)
    assert np.ptp(found.values[1000:1100], axis=0).max() == 0.0 and np.isfinite(found.values).all()


def test_without_a_change_the_end_is_the_batch_fit() -> None:
    off = list[Array]()
    for seed in range(6):
        channels = motion(40.0, 12 + seed)
        measured = force(channels, 30 + seed, fy=820.0, c=760.0, f0=38.0)
        found = tracked(measured, channels)
        rows = np.column_stack([columns(channels)[n] for n in TRACKED])
        rest = VALUES["k"] * columns(channels)["k"]
        batch = np.linalg.lstsq(rows[found.moves > 0], (measured - rest)[found.moves > 0], rcond=None)[0]
        off.append((found.values[-1] - batch) / found.deviations[-1])
    assert np.sqrt(np.mean(np.square(off), axis=0)).max() < 1.0


def test_a_bound_holds() -> None:
    channels, source = motion(2.0, 14), fitted()
    plan = plan_of(source, ("fy", "c"))
    low = replace(plan.parameters[1], low=650.0)
    plan = replace(plan, parameters=(plan.parameters[0], low))
    found = track_log(source, plan, channels, force(channels, 15, c=200.0), DT)
    assert found.values[:, 1].min() == pytest.approx(650.0) and found.values[-1, 1] < 660.0


def test_a_parameter_that_is_not_there_is_named() -> None:
    with pytest.raises(ConfigError, match="--track fx: the model tanh has fy, a1"):
        plan_of(fitted(), ("fx",))
