"""What SPECs, settings and small helpers of the core say of themselves."""

from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
import pytest

from mrfit.core import progress
from mrfit.core.counting import few
from mrfit.core.grouping import grouped
from mrfit.core.recording import Recording
from mrfit.core.registry import elements, equations_of_effects, load
from mrfit.core.responses import one_by_one, quiet
from mrfit.core.setting import UNSET, Setting, defined, explained, flag_of, key_of
from mrfit.core.specs import SLOTS, Array, EffectSpec, ModelSpec, OptimizerSpec, Option, Param

HELD = Param("D", "m", 0.1, 10.0, 2.5, fixed=True)
FREE = Param("c", "N*s/m", 0.0, 10.0, 1.5)
SPEC = ModelSpec("own", "", "", "", ("velocity",), "force", (FREE, HELD))


def test_a_fit_may_lack_only_a_parameter_that_its_model_holds() -> None:
    assert SPEC.theta({"c": 4.0, "D": 3.0}).tolist() == [4.0, 3.0]
    assert SPEC.theta({"c": 4.0}).tolist() == [4.0, 2.5]
    with pytest.raises(KeyError, match="c"):
        SPEC.theta({"D": 3.0})


def test_effects_act_by_slot_then_by_turn_then_by_name() -> None:
    def effect(name: str, slot: str, turn: int = 0) -> EffectSpec:
        return EffectSpec(name, "", "", "", slot, ("force",), (), (), (), turn=turn)  # type: ignore[arg-type]

    placed = [
        effect("z", "input"),
        effect("a", "theta"),
        effect("y", "add", -1),
        effect("b", "add"),
        effect("c", "add"),
    ]
    placed += [effect("a", "add", 1), effect("a", "output"), effect("a", "record")]
    assert sorted(reversed(placed), key=lambda s: s.place) == placed
    # a loop is closed about what its input was made to, before parameters vary
    assert SLOTS.index("input") < SLOTS.index("loop") < SLOTS.index("theta") < SLOTS.index("add")


def test_options_that_nobody_names_are_at_their_defaults() -> None:
    options = (Option("F", 0.7, 0.0, 2.0, ""), Option("N", 40.0, 4.0, 400.0, "", whole=True))
    assert OptimizerSpec("own", "", "", "global", lambda k, o: 1, options).defaults == {"F": 0.7, "N": 40.0}


@pytest.mark.parametrize(
    ("setting", "number", "said"),
    [
        (Setting("", low=0.0), 0.0, ""),
        (Setting("", low=0.5), 0.49, "--x takes 0.5 or more, not 0.49"),
        (Setting("", high=8.0), 8.0, ""),
        (Setting("", high=8.0), 8.5, "--x takes 8 or less, not 8.5"),
        (Setting("", above=0.0), 1e-12, ""),
        (Setting("", above=0.0), 0.0, "--x takes a number above 0, not 0"),
        (Setting("", low=1), 10**30, ""),
        (Setting("", high=1), 10**250, f"--x takes 1 or less, not {'1' + '0' * 199}…"),
    ],
)
def test_limits_hold_on_either_side(setting: Setting, number: float, said: str) -> None:
    assert setting.refusal("--x", number) == said


@dataclass(frozen=True)
class Rough:
    """Settings of a rough search.

    Attributes
    ----------
    depth
        How deep it looks, in
        halvings.
    """

    depth: Annotated[int, Setting("Depth.", flag="deep", key="deepness")] = 3
    way: Annotated[Literal["up", "down"] | None, Setting("Way.")] = None
    inner: float = 1.0


@dataclass(frozen=True)
class Fine(Rough):
    """Settings of a fine one.

    Attributes
    ----------
    inner
        Of programs alone.
    """

    passes: Annotated[tuple[str, ...], Setting("Passes.", key="turns")] = ()


def test_a_docstring_on_a_field_goes_before_the_line_of_its_help() -> None:
    assert explained(Rough) == {"depth": "How deep it looks, in halvings.", "way": "Way."}
    assert explained(Fine) == {**explained(Rough), "passes": "Passes.", "inner": "Of programs alone."}


def test_names_of_a_field_follow_from_the_nearest_that_is_given() -> None:
    fields = {f.name: f for f in defined(Fine)}
    assert [flag_of(f) for f in fields.values()] == ["deep", "way", "inner", "passes"]
    assert [key_of(f) for f in fields.values()] == ["deepness", "way", "inner", "turns"]
    assert (fields["way"].choices, fields["way"].optional) == (("up", "down"), True)
    assert (fields["depth"].choices, fields["depth"].optional, fields["depth"].default) == ((), False, 3)
    # a tuple of words is no choice among them
    assert fields["passes"].alternatives == (tuple[str, ...],) and UNSET not in [f.default for f in fields.values()]


def test_values_that_share_something_are_together_in_their_order() -> None:
    pairs = [("b", 1), ("a", 2), ("b", 3), ("a", 2)]
    assert list(grouped(pairs).items()) == [("b", [1, 3]), ("a", [2, 2])]


def test_the_first_of_many_names_are_told_and_how_many_more_there_are() -> None:
    assert few(["a", "b"], 2) == "a, b"
    assert few(["a", "b", "c", "d"], 2, " and ") == "a and b and 2 more"
    assert few(range(13)).endswith("10, 11 and 1 more")


def test_a_written_model_has_a_base_and_effects_beside_what_it_carries() -> None:
    assert elements("tanh+inertia+delay@force-displacement") == ("tanh", ["inertia", "delay"])
    assert elements("tanh@base-acceleration") == ("tanh", [])
    said = equations_of_effects("tanh+inertia+no-such-effect+delay")
    assert said == [f"{n}: {load('effect', n).SPEC.equation}" for n in ("inertia", "delay")]


def test_a_function_of_one_vector_that_fails_in_arithmetic_has_no_numbers_there() -> None:
    def response(drive: Array, theta: Array, dt: float) -> Array:
        if theta[0] < 0.0:
            raise OverflowError
        if theta[0] == 0.0:
            raise KeyError("its own fault")
        return theta[0] * drive[0] / dt

    batched, drive = one_by_one(response), np.array([[1.0, 2.0]])
    found = batched(drive, np.array([[3.0], [-1.0], [4.0]]), 0.5)
    assert np.array_equal(found, [[6.0, 12.0], [np.nan, np.nan], [8.0, 16.0]], equal_nan=True)
    with pytest.raises(KeyError):
        batched(drive, np.zeros((1, 1)), 0.5)
    with np.errstate(all="raise"):
        assert np.isinf(quiet(lambda drive, theta, dt: drive / 0.0)(drive, np.zeros((1, 1)), 1.0)).all()


def test_compilation_is_told_to_who_listens_last_and_then_again_to_who_did_before() -> None:
    heard: list[tuple[str, int]] = []

    def listener(name: str) -> progress.Progress:
        return lambda what, done, total: heard.append((name, done))

    with progress.on_compilation(listener("outer")):
        with pytest.raises(KeyError), progress.on_compilation(listener("inner")):
            progress.tell_compilation(0)
            raise KeyError
        progress.tell_compilation(1)
    progress.tell_compilation(1)
    assert heard == [("inner", 0), ("outer", 1)]


def test_a_recording_without_channels_has_no_samples() -> None:
    bare = Recording("r", "r", "", "none", 1.0, 0.0, {}, {})
    assert bare.samples == 0
    assert replace(bare, channels={"force": np.zeros(7)}).samples == 7
