"""What an examination names is a set with what a base taken as exact names, where both break the same."""

import pytest

from mrfit.core import registry
from mrfit.discover.invariance.findings import LawFindings
from mrfit.discover.writing.beside_open_law import with_unexamined
from mrfit.io.schemas.discovery import InvariantEffect


def found(name: str, *one_of: str) -> InvariantEffect:
    breaks = registry.load("effect", name).SPEC.breaks
    return InvariantEffect(name=name, breaks=breaks.invariance, tier="any-law", one_of=one_of)


@pytest.mark.parametrize(
    ("name", "exact", "one_of"),
    [
        # a valve that opens in one direction breaks the symmetry as well, and cannot be examined
        ("asymmetry", ("relief-valve",), ("relief-valve",)),
        ("asymmetry", ("gas-spring", "relief-valve"), ("relief-valve",)),
        # without the base's proof of it nothing speaks for it
        ("asymmetry", (), ()),
        ("asymmetry", ("gas-spring",), ()),
        # an effect that it is mistaken for elsewhere breaks nothing
        ("temperature", ("current-saturation",), ()),
    ],
)
def test_an_effect_is_a_set_with_an_unexamined_one_of_the_base(
    name: str, exact: tuple[str, ...], one_of: tuple[str, ...]
) -> None:
    (effect,) = with_unexamined(LawFindings(named=(found(name),)), exact).named
    assert effect.one_of == one_of


def test_a_set_is_told_once() -> None:
    (effect,) = with_unexamined(LawFindings(named=(found("asymmetry", "relief-valve"),)), ("relief-valve",)).named
    assert effect.one_of == ("relief-valve",)


def test_effects_that_are_said_to_be_unexamined_are_in_the_library_and_break_nothing_themselves() -> None:
    for name in registry.names("effect"):
        breaks = registry.load("effect", name).SPEC.breaks
        for other in breaks.unexamined if breaks else ():
            assert registry.load("effect", other).SPEC.breaks is None
