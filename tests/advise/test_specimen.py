"""A test as the specimen sees it, and which channels a rig can move."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from mrfit.advise.criterion import DifferenceInformation
from mrfit.advise.drives import RigBench, Test
from mrfit.advise.rig import rig_of
from mrfit.advise.rivalry import OTHER_CURRENT, OTHER_FREQUENCY, _differs
from mrfit.advise.separation import PredictedOutput, RivalSet, TestOutcome, orders
from mrfit.advise.specimen import Channels, Specimen, _currents, _heating, rigged_of, rows_of, unmovable
from mrfit.advise.standing import RIVAL_STEP, FittedRival, stencil
from mrfit.core.specs import Array
from mrfit.discover.evidence.bench import Bench
from mrfit.errors import ConfigError
from mrfit.simulate.assembly import Assembly

TestOutcome.__test__ = False
DT = 0.01
PRESS = rig_of({"seconds": 10, "stroke": 0.05, "speed": 0.2})


def specimen(output: str = "force", heating: float = 0.0, temperatures: Any = None, **levels: float) -> Specimen:
    return Specimen(Channels.of(output), levels, heating, temperatures)


def moving(current: Array | None = None, warmth: Array | None = None) -> Test:
    motion = np.stack([np.linspace(0.0, 1.0, 50), np.full(50, 2.0), np.zeros(50)])
    empty = np.empty(0)
    return Test("sine", DT, motion, empty if current is None else current, empty if warmth is None else warmth)


@pytest.mark.parametrize(
    ("output", "channels"),
    [
        ("force", ("displacement", "velocity", "acceleration")),
        ("torque", ("angle", "angular_velocity", "angular_acceleration")),
        ("flux", ("current", "", "")),
    ],
)
def test_what_drives_a_specimen_follows_from_its_output(output: str, channels: tuple[str, str, str]) -> None:
    own = Channels.of(output)
    assert (own.motion, own.rate, own.second) == channels


@pytest.mark.parametrize("output", ["current", "pressure"])
def test_an_output_that_no_rig_works_against_is_refused(output: str) -> None:
    with pytest.raises(ConfigError, match=f"no test is known for a model of {output}"):
        Channels.of(output)


def test_a_motion_is_about_the_middle_of_the_data_and_other_channels_at_their_level() -> None:
    found = specimen(displacement=0.3, pressure=5.0, velocity=9.0, current=1.0).driven(moving())
    assert found["displacement"] == pytest.approx(0.3 + moving().motion[0])
    assert found["velocity"] == pytest.approx(moving().motion[1]) and "acceleration" in found
    assert set(found["pressure"]) == {5.0} and set(found["current"]) == {1.0}
    assert found["time"] == pytest.approx(DT * np.arange(50)) and set(found["heat_before"]) == {0.0}
    # the rig's own current comes before that of the data
    assert set(specimen(current=1.0).driven(moving(current=np.full(50, 2.0)))["current"]) == {2.0}


def test_a_coil_is_driven_by_the_current_itself() -> None:
    found = specimen("flux", current=0.7).driven(moving())
    assert found["current"] == pytest.approx(moving().motion[0]) and "displacement" not in found


def test_a_specimen_is_brought_from_the_lowest_to_the_highest_temperature() -> None:
    warmth = (np.arange(50) >= 25).astype(float)
    found = specimen(temperatures=(20.0, 60.0), temperature=30.0).driven(moving(warmth=warmth))
    assert set(found["temperature"][:25]) == {20.0} and set(found["temperature"][25:]) == {60.0}
    assert set(specimen(temperature=30.0).driven(moving(warmth=warmth))["temperature"]) == {30.0}


def test_work_warms_a_specimen_by_what_its_data_say() -> None:
    own = specimen(heating=0.5, temperature=30.0)
    cold = own.driven(moving())
    warm = own.heated(cold, np.full(50, -100.0), DT)
    # 100 N at 2 m/s for half a second, whatever the sign of the force
    assert warm["temperature"][-1] == pytest.approx(30.0 + 0.5 * 100.0)
    assert warm["temperature"][0] == pytest.approx(30.0 + 0.5 * 2.0)
    for unheated in (specimen(temperature=30.0), specimen(heating=0.5)):
        still = unheated.driven(moving())
        assert unheated.heated(still, np.full(50, 100.0), DT).keys() == still.keys()
        assert np.array_equal(
            unheated.heated(still, np.full(50, 1e3), DT).get("temperature", 30.0), still.get("temperature", 30.0)
        )


@pytest.mark.parametrize(
    ("name", "rig", "heating", "movable"),
    [
        ("displacement", {}, 0.0, True),
        ("acceleration", {}, 0.0, True),
        ("time", {}, 0.0, True),
        ("heat_before", {}, 0.0, True),
        ("pressure", {}, 0.0, False),
        ("current", {}, 0.0, False),
        ("current", {"current": 2.0}, 0.0, True),
        ("temperature", {}, 0.0, False),
        ("temperature", {"temperature": [20, 60]}, 0.0, True),
        # the work of a test moves it
        ("temperature", {}, 0.1, True),
    ],
)
def test_what_a_rig_can_move(name: str, rig: dict[str, Any], heating: float, movable: bool) -> None:
    own, limits = specimen(heating=heating), rig_of({"seconds": 10, "stroke": 0.05, "speed": 0.2, **rig})
    assert own.moves(name, limits) is movable
    assert unmovable(["velocity", name], own, limits) == ("" if movable else name)


def test_a_channel_that_no_log_has_is_named() -> None:
    assembly = cast(Assembly, SimpleNamespace(name="dahl", spec=SimpleNamespace(inputs=("velocity", "pressure"))))
    found = specimen(pressure=5.0).driven(moving())
    assert rows_of(found, assembly).shape == (2, 50) and rows_of(found, assembly)[1, 0] == 5.0
    with pytest.raises(ConfigError, match="dahl takes pressure, which no test of this rig moves and no log has"):
        rows_of(specimen().driven(moving()), assembly)


def stretch(role: str = "train", dt: float = DT, force: Array | None = None, **channels: Array) -> Any:
    return SimpleNamespace(
        channel=channels.get, names=tuple(channels), role=role, measured=force, block=SimpleNamespace(dt=dt)
    )


def bench(*stretches: Any) -> Bench:
    return cast(Bench, SimpleNamespace(stretches=stretches, of_role=lambda r: [s for s in stretches if s.role == r]))


def test_heating_is_the_slope_of_temperature_over_work_of_records_each_from_its_own_level() -> None:
    rng, parts = np.random.default_rng(1), []
    for level, size in ((20.0, 100.0), (45.0, 300.0)):
        force, velocity = size * rng.standard_normal(400), rng.standard_normal(400)
        work = np.cumsum(np.abs(force * velocity)) * DT
        parts.append(stretch(force=force, velocity=velocity, temperature=level + 0.02 * work))
    assert _heating(bench(*parts), Channels.of("force")) == pytest.approx(0.02)
    cooling = [
        stretch(force=p.measured, velocity=p.channel("velocity"), temperature=-p.channel("temperature")) for p in parts
    ]
    assert _heating(bench(*cooling), Channels.of("force")) == 0.0
    # a record without its temperature, and one in which nothing is done
    assert _heating(bench(parts[0], stretch(force=np.ones(9), velocity=np.ones(9))), Channels.of("force")) == 0.0
    assert (
        _heating(
            bench(stretch(force=np.zeros(9), velocity=np.ones(9), temperature=np.arange(9.0))), Channels.of("force")
        )
        == 0.0
    )


@pytest.mark.parametrize(
    ("logged", "rig", "used"),
    [
        ((0.5, 2.0), [0.0, 3.0], (0.5, 2.0)),
        ((-1.0, 9.0), [0.0, 3.0], (0.0, 3.0)),
        # a fifth of the rig's range or less is no range
        ((1.0, 1.6), [0.0, 3.0], (0.0, 3.0)),
        ((1.0, 1.61), [0.0, 3.0], (1.0, 1.61)),
        (None, [0.0, 3.0], (0.0, 3.0)),
        ((0.5, 2.0), None, None),
    ],
)
def test_currents_of_tests_are_those_of_the_data_where_these_range(
    logged: tuple[float, float] | None, rig: list[float] | None, used: tuple[float, float] | None
) -> None:
    parts = [stretch(current=np.array(logged))] if logged else [stretch()]
    held = stretch("holdout", current=np.array([-50.0, 50.0]))
    limits = rig_of({"seconds": 10, "stroke": 0.05, "speed": 0.2, **({"current": rig} if rig else {})})
    assert _currents(bench(*parts, held), limits) == used


def test_a_test_is_sampled_as_the_rig_says_else_as_most_logs_are() -> None:
    parts = bench(stretch(dt=0.01), stretch(dt=0.01), stretch(dt=0.5))
    assert rigged_of(parts, Channels.of("force"), PRESS).dt == pytest.approx(0.01)
    stated = rig_of({"seconds": 10, "stroke": 0.05, "speed": 0.2, "sampling": "2 kHz", "current": 3.0})
    assert rigged_of(parts, Channels.of("force"), stated).dt == pytest.approx(5e-4)
    coil = rig_of({"seconds": 10, "current": 3.0, "current_rate": 50.0})
    driven = rigged_of(parts, Channels.of("flux"), coil)
    assert driven.current is None and driven.reach.amplitude == 3.0 and driven.reach.speed == 50.0


def at(frequency: float, current: float | None = None) -> Test:
    numbers = {"frequency": frequency} | ({} if current is None else {"current": current})
    return Test("sine", DT, np.zeros((3, 4)), np.empty(0), np.empty(0), numbers=numbers)


@pytest.mark.parametrize(
    ("frequency", "current", "differs"),
    [
        (2.0 * OTHER_FREQUENCY * 1.01, 1.0, True),
        (2.0 / OTHER_FREQUENCY / 1.01, 1.0, True),
        (2.0 * OTHER_FREQUENCY * 0.99, 1.0, False),
        (2.0, 1.0 + 1.01 * OTHER_CURRENT * 4.0, True),
        (2.0, 1.0 - 1.01 * OTHER_CURRENT * 4.0, True),
        (2.0, 1.0 + 0.99 * OTHER_CURRENT * 4.0, False),
    ],
)
def test_a_second_test_is_no_repetition_of_the_first(frequency: float, current: float, differs: bool) -> None:
    rigged = cast(RigBench, SimpleNamespace(current=(0.0, 4.0)))
    assert _differs(at(frequency, current), at(2.0, 1.0), rigged) is differs
    without = cast(RigBench, SimpleNamespace(current=None))
    assert _differs(at(2.0), at(2.0), without) is False and _differs(at(4.0), at(2.0), without) is True


def rival(*effects: str, name: str = "") -> FittedRival:
    return cast(FittedRival, SimpleNamespace(rival=SimpleNamespace(effects=effects, name=name or "+".join(effects))))


def test_a_model_that_holds_another_is_never_mistaken_for_it_and_the_other_way_round() -> None:
    # the model as found passes for one with an effect more, which cannot pass for it: it takes its value of none
    assert orders([rival(), rival("delay")]) == [(1, 0)]
    assert orders([rival("delay"), rival("inertia")]) == [(0, 1), (1, 0)]
    assert orders([rival("a", "b"), rival("a"), rival("c")]) == [(0, 1), (0, 2), (1, 2), (2, 0), (2, 1)]


def known(*squared: float) -> DifferenceInformation:
    """Data that put draws so far apart, squared, and of whose parameter a unit is known."""
    return DifferenceInformation(np.eye(1), np.zeros((1, len(squared))), np.array(squared))


def rivals(pairs: dict[tuple[int, int], DifferenceInformation], count: int) -> RivalSet:
    made = tuple(rival(name=f"r{k}") for k in range(count))
    return RivalSet(made, (), pairs, 1.0, specimen())


def test_a_pair_is_as_far_apart_as_the_harder_of_both_to_take_for_the_other() -> None:
    own = rivals({(0, 1): known(9.0, 25.0), (1, 0): known(4.0), (0, 2): known(1.0), (2, 1): known(16.0)}, 3)
    assert own.pairs == [(0, 1), (0, 2), (1, 2)] and own.names == ("r0", "r1", "r2")
    # in the mean over draws, of the roots
    assert own.left() == pytest.approx([2.0, 1.0, 4.0])
    assert rivals({(0, 1): known(9.0, 25.0)}, 2).left() == pytest.approx([4.0])


def test_a_test_adds_what_no_refit_of_the_other_takes() -> None:
    own = rivals({(0, 1): known(7.0, 7.0), (1, 0): known(100.0)}, 2)
    true = PredictedOutput(np.zeros(2), np.array([[3.0, 4.0], [0.0, 8.0]]), np.array([[0.0], [0.0]]))
    # its one parameter moves the first sample, and a unit of it is known
    other = PredictedOutput(np.zeros(2), np.array([[50.0, 50.0]]), np.array([[1.0], [0.0]]))
    found = own.distances(TestOutcome((true, other), 1.0))
    # 3²/2 + 4² and 8², in the mean of the roots
    assert found == pytest.approx([(np.sqrt(4.5 + 16.0) + 8.0) / 2.0])


@pytest.mark.parametrize("spoilt", ["centre", "jacobian", ""])
def test_a_test_that_a_rival_cannot_be_simulated_on_is_none(spoilt: str) -> None:
    parts = {"centre": np.zeros(2), "drawn": np.zeros((1, 2)), "jacobian": np.zeros((2, 1))}
    if spoilt:
        parts[spoilt] = parts[spoilt] * np.nan
    assert TestOutcome((PredictedOutput(**parts),), 1.0).finite is not bool(spoilt)


def test_steps_of_differences_stay_within_the_cube() -> None:
    points, steps = stencil(np.array([0.0, 0.4, 0.6, 1.0]))
    assert steps == pytest.approx(RIVAL_STEP * np.array([1.0, 1.0, -1.0, -1.0]))
    assert points.shape == (5, 4) and points.min() >= 0.0 and points.max() <= 1.0
    assert points[1:] - points[0] == pytest.approx(np.diag(steps))
