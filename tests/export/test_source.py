"""The source of an export: the parts of its parameters, ranges of its logs, samples without gaps, what is compared."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.errors import ConfigError, DataError
from mrfit.export.source import SAMPLES_COMPARED, ExportSource, LogStretch, runs, source_of
from mrfit.io.schemas.fit import Quantity, Result
from mrfit.simulate.current_dependence import CurrentDependence
from tests.export.rigs import rig


@pytest.fixture(scope="module")
def plain() -> ExportSource:
    return rig("biviscous", seconds=0.1)


def logged(source: ExportSource, output: Array, **inputs: Array) -> LogStretch:
    (first,) = source.stretches
    return replace(first, inputs={**first.inputs, **inputs}, measured=output, simulated=output)


def test_effects_act_in_the_order_of_their_slots_and_have_their_own_parameters() -> None:
    # written in the other order: terms act before the output is late, and the base comes first
    source = rig("tanh+delay+inertia", CurrentDependence((("fy", 1),), 0.1, 1.5), seconds=0.1)
    values = dict(zip(source.spec.names, source.theta.tolist(), strict=True))
    assert [link.spec.name for link in source.links] == ["inertia", "delay"]
    for link in source.links:
        own = [values[f"{link.spec.name}.{p.name}"] for p in link.spec.params]
        assert link.theta.tolist() == own
    # fy has a value at two currents
    assert len(source.base_theta) == len(source.base.params) + 1
    assert source.base_theta.tolist() == [v for n, v in values.items() if "." not in n.partition("@")[0]]


def test_a_dependence_without_order_is_none() -> None:
    assert rig("tanh", seconds=0.1).dependence is None
    held = CurrentDependence((("fy", 1),), 0.1, 1.5)
    assert rig("tanh", held, seconds=0.1).dependence == held


def test_ranges_are_those_of_all_logs_and_of_rates_alike_in_both_directions(plain: ExportSource) -> None:
    def ramp(low: float, high: float) -> Array:
        return np.linspace(low, high, 50)

    logs = (
        logged(plain, ramp(-300.0, 100.0), velocity=ramp(-0.2, 0.1)),
        logged(plain, ramp(0.0, 500.0), velocity=ramp(0.05, 0.15)),
    )
    source = replace(plain, stretches=logs)
    # a force is no rate
    assert source.ranges == {"velocity": (-0.2, 0.2), "force": (-300.0, 500.0)}
    assert source.output_range == 800.0


def test_a_flux_linkage_keeps_its_own_range_and_an_output_that_rests_has_the_extent_1() -> None:
    source = rig("boucwen-flux", seconds=0.1)
    (log,) = source.stretches
    current = np.linspace(-0.5, 2.0, len(log.measured))
    moved = replace(log, inputs={**log.inputs, "current": current}, simulated=np.full(len(current), 0.3))
    given = replace(source, stretches=(moved,))
    assert given.ranges == {"current": (-0.5, 2.0), "flux": (0.3, 0.3)} and given.output_range == 1.0
    assert replace(source, stretches=()).output_range == 1.0 and not replace(source, stretches=()).ranges


def test_time_counts_from_a_stretch_s_first_sample_and_constants_of_a_record_are_0() -> None:
    source = rig("tanh+gain-drift", seconds=0.1)
    rows = dict(zip(source.spec.inputs, source.drive(source.stretches[0]), strict=True))
    np.testing.assert_allclose(rows["time"], 1e-3 * np.arange(101), rtol=1e-14)
    np.testing.assert_array_equal(rows["velocity"], source.stretches[0].inputs["velocity"])
    assert "time" not in source.channels and "velocity" in source.channels


def test_the_fingerprint_is_that_of_what_the_fit_says(plain: ExportSource) -> None:
    assert replace(plain, stretches=()).digest == plain.digest and len(plain.digest) == 64
    assert plain.digest != rig("biviscous", seconds=0.1, changes={"vy": 0.02}).digest


def test_no_more_samples_are_compared_than_is_said(plain: ExportSource) -> None:
    def lengths(logs: int, samples: int) -> list[int]:
        (first,) = plain.stretches
        long = replace(first, inputs={"velocity": np.zeros(samples)}, measured=np.zeros(samples))
        return [drive.shape[1] for drive, _ in replace(plain, stretches=(long,) * logs).compared()]

    assert lengths(1, 2_000) == [2_000]
    assert lengths(4, 60_000) == 4 * [SAMPLES_COMPARED // 4]
    # of many logs a piece of each, as far as all have one of 500 samples
    assert lengths(SAMPLES_COMPARED // 500 + 7, 600) == SAMPLES_COMPARED // 500 * [500]
    assert replace(plain, stretches=()).compared() == []


@pytest.mark.parametrize(
    ("times", "pieces"),
    [
        (np.arange(6) * 0.1, [[0, 1, 2, 3, 4, 5]]),
        (np.array([0.0, 0.1, 0.2, 0.5, 0.6]), [[0, 1, 2], [3, 4]]),
        # a sample alone between two gaps is no run
        (np.array([0.0, 0.1, 0.2, 0.5, 0.9, 1.0]), [[0, 1, 2], [4, 5]]),
        # what jitters by less than half an interval has no gap
        (np.array([0.0, 0.1, 0.2, 0.34, 0.4]), [[0, 1, 2, 3, 4]]),
        (np.array([3.0]), []),
        (np.array([]), []),
    ],
)
def test_runs_end_at_gaps(times: Array, pieces: list[list[int]]) -> None:
    found = runs(times)
    assert [run.tolist() for run, _ in found] == pieces
    # rounding in the difference of times is not in the interval
    assert all(dt == 0.1 for _, dt in found)


def several(source: ExportSource, **values: Mapping[str, float]) -> ExportSource:
    """Return a fit that has a set of parameters for each of several conditions."""
    results = [
        Result(condition=c, evaluations=0, parameters=[Quantity(name=n, value=v) for n, v in given.items()])
        for c, given in values.items()
    ]
    return replace(source, content=replace(source.content, name="several", results=results))


def test_a_condition_has_its_own_parameters_and_its_own_logs(plain: ExportSource) -> None:
    start = dict(zip(plain.spec.names, plain.theta.tolist(), strict=True))
    both = several(plain, slow=start, fast={**start, "vy": 0.7})
    (log,) = plain.stretches
    logs = [replace(log, condition=c) for c in ("slow", "fast", "fast")]
    found = source_of(both.content, both.assembly, logs, "fast")
    assert found.condition == "fast" and [s.condition for s in found.stretches] == ["fast", "fast"]
    assert found.theta[found.spec.names.index("vy")] == 0.7
    with pytest.raises(ConfigError, match=r"^several: has 2 sets of parameters; name one with --condition \(slow"):
        source_of(both.content, both.assembly, logs)
    with pytest.raises(ConfigError, match="^--condition 'late': several has no parameters of it; there are slow"):
        source_of(both.content, both.assembly, logs, "late")
    # one set needs no name, and a joint one has all logs
    alone = source_of(several(plain, slow=start).content, both.assembly, logs)
    assert alone.condition == "slow" and len(alone.stretches) == 1
    assert len(source_of(several(plain, all=start).content, both.assembly, logs).stretches) == 3


def test_a_parameter_that_is_no_number_is_refused(plain: ExportSource) -> None:
    values = dict(zip(plain.spec.names, plain.theta.tolist(), strict=True))
    broken = several(plain, all={**values, "vy": float("nan")})
    with pytest.raises(DataError, match="^several: a parameter is not a number: fit again$"):
        source_of(broken.content, broken.assembly, [])


def test_a_mass_keeps_its_own_parameter_beside_those_of_effects() -> None:
    from mrfit.simulate.assembly import assemble

    whole = assemble("tanh+delay@base-velocity")
    theta = np.arange(1.0, len(whole.spec.params) + 1.0)
    source = replace(rig("tanh", seconds=0.1), assembly=whole, theta=theta, stretches=())
    (link,) = source.links
    assert source.is_driven and source.law_name == "tanh+delay" and source.base.name == "tanh"
    assert [*source.base_theta, *link.theta, theta[-1]] == theta.tolist() and len(link.theta) == len(link.spec.params)
    kept = source_of(several(source, all=dict(zip(whole.spec.names, theta, strict=True))).content, whole, [])
    left = source_of(kept.content, whole, [], without=("delay",))
    assert left.assembly.name == "tanh@base-velocity" and left.theta[-1] == theta[-1]
    assert left.base_theta.tolist() == source.base_theta.tolist()
