from dataclasses import replace

import numpy as np
import pytest

from mrfit.core import registry
from mrfit.fit.extrapolation import ConditionInputs, beyond, extrapolations, is_new_current, outside, together

TIME = np.arange(1000) / 1000.0


def stretch(amplitude: float, current: float = 1.0, temperature: float = 25.0, names: str = "xvi") -> ConditionInputs:
    omega = 4.0 * np.pi
    channels = {
        "displacement": amplitude * np.sin(omega * TIME),
        "velocity": amplitude * omega * np.cos(omega * TIME),
        "current": np.full(1000, current),
    }
    kept = {n: v for n, v in channels.items() if n[0] in names.replace("x", "d").replace("i", "c")}
    return ConditionInputs(f"sine-{amplitude:g}", 1e-3, kept, temperature, "displacement", amplitude)


TRAINED = together([stretch(0.01, 0.0).extents(), stretch(0.02, 2.0).extents()])


def channels(found: ConditionInputs, trained: dict[str, tuple[float, float]] = TRAINED) -> list[str]:
    return [c.text.partition(" reaches")[0] for c in extrapolations(trained, [stretch(0.01), found])]


@pytest.mark.parametrize(
    ("found", "named"),
    [
        (stretch(0.015, 1.0), []),
        (stretch(0.0205, 2.05), []),
        (stretch(0.03), ["displacement", "velocity"]),
        (stretch(0.01, 3.0), ["current"]),
        (stretch(0.01, -1.0), ["current"]),
        (stretch(0.01, 1.0, 60.0), ["temperature"]),
        (stretch(0.01, 1.0, float("nan")), []),
    ],
)
def test_a_channel_that_leaves_what_was_fitted_is_named_and_no_other(found: ConditionInputs, named: list[str]) -> None:
    assert channels(found) == named


def test_speed_is_looked_at_where_displacement_alone_is_an_input() -> None:
    trained = together([stretch(0.01, names="x").extents()])
    fast = ConditionInputs("fast", 1e-3, {"displacement": 0.01 * np.sin(40.0 * np.pi * TIME)})
    assert channels(fast, trained) == ["velocity"]


def test_stroke_is_looked_at_where_velocity_alone_is_an_input() -> None:
    trained = together([stretch(0.01, names="v").extents()])
    slow = ConditionInputs("slow", 1e-3, {"velocity": stretch(0.01).inputs["velocity"]}, 25.0, "displacement", 0.05)
    assert channels(slow, trained) == ["displacement"]


def test_the_warning_says_how_far_and_where() -> None:
    (warning,) = extrapolations(TRAINED, [stretch(0.01, 3.0), stretch(0.01, 4.0), stretch(0.01, 1.0)])
    assert warning.kind == "extrapolation"
    assert warning.text.startswith("current reaches 4 A in sine-0.01 and 1 more segment; the fit was made at 0 to 2 A")


@pytest.mark.parametrize(
    ("low", "high", "new"),
    [(0.0, 0.0, False), (2.05, 2.08, False), (1.0, 1.0, True), (2.2, 2.2, True), (0.0, 2.0, True)],
)
def test_a_current_is_new_that_no_test_had(low: float, high: float, new: bool) -> None:
    fitted = [stretch(0.01, 0.0).extents(), stretch(0.02, 2.0).extents()]
    assert is_new_current(fitted, {"current": (low, high)}) is new
    # where it moved in a test it was everywhere on its way
    moved = [*fitted, {"current": (0.0, 2.0)}]
    assert is_new_current(moved, {"current": (low, high)}) is (high > 2.1)
    assert not is_new_current(fitted, {"velocity": (-1.0, 1.0)})


def test_a_constant_of_a_record_is_no_range() -> None:
    def record(value: float) -> ConditionInputs:
        inputs = {"current": np.sin(TIME), "heat_before": np.full(1000, value), "flux_resistance": np.full(1000, value)}
        return ConditionInputs("coil", 1e-3, inputs)

    assert extrapolations(record(2.0).extents(), [record(-50.0)]) == []


@pytest.mark.parametrize("drive", ["", "@force-displacement"])
def test_an_effect_beyond_what_it_was_found_on_is_named_on_a_mass_too(
    drive: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    spec = replace(registry.load("effect", "inertia").SPEC, within=(("velocity", -0.1, 0.1), ("current", 0.0, 2.0)))
    monkeypatch.setattr(registry.load("effect", "inertia"), "SPEC", spec)
    assert outside(f"tanh+delay+inertia{drive}", [{"velocity": (-0.1, 0.109), "current": (0.5, 1.0)}]) == []
    (said,) = outside(f"tanh+delay+inertia{drive}", [{"velocity": (-0.05, 0.05)}, {"velocity": (-0.3, 0.0)}])
    assert said.text.startswith("inertia was found at velocity -0.1 to 0.1 m/s; here is velocity -0.3 to 0.05 m/s:")


def test_how_far_beyond_is_the_overshoot_of_the_worst_channel_over_its_range_or_level() -> None:
    trained = {"current": (2.0, 2.0), "velocity": (-0.1, 0.1), "angle": (0.0, 0.0)}
    assert beyond(trained, {"current": (1.91, 2.09), "velocity": (-0.109, 0.1), "angle": (-1.0, 1.0)}) == 0.0
    # 1 A beyond a level of 2 A, less 5 %; the velocity goes 0.06 beyond a range of 0.2
    assert beyond(trained, {"current": (1.0, 2.0), "velocity": (-0.1, 0.16)}) == pytest.approx(np.log1p(0.45))
    assert beyond(trained, {"force": (0.0, 1e6)}) == 0.0
