import pytest

from mrfit.io.schemas.determined import State, state_of
from mrfit.io.schemas.fit import Quantity
from mrfit.report.determined import counted, words_of


def quantity(value: float, low: float | None, high: float | None, bounds=(0.1, 1e3), **more) -> Quantity:
    return Quantity(name="c", value=value, low=low, high=high, bound_low=bounds[0], bound_high=bounds[1], **more)


@pytest.mark.parametrize(
    ("q", "state", "words"),
    [
        (quantity(10.0, 9.0, 11.0), State.WELL, ""),
        (quantity(10.0, 7.5, 12.5), State.WELL, ""),
        (quantity(10.0, 7.0, 13.0), State.POORLY, "poorly determined (± 30 %)"),
        (quantity(10.0, None, 13.0), State.POORLY, "poorly determined"),
        (quantity(10.0, None, None), State.NOT, "not determined"),
        (quantity(10.0, 9.0, 11.0, identifiable=False), State.NOT, "not determined"),
        (quantity(10.0, 10.0, 10.0, fixed=True), State.HELD, ""),
        # an offset of about nothing, known to a hundredth of what it may be
        (quantity(0.1, -0.9, 1.1, (-50.0, 50.0)), State.WELL, ""),
        (quantity(0.1, -29.9, 30.1, (-50.0, 50.0)), State.POORLY, "poorly determined (± 30000 %)"),
        # the same width beside zero is poor where the value cannot be zero
        (quantity(0.2, 0.1, 0.3, (0.1, 50.0)), State.POORLY, "poorly determined (± 50 %)"),
    ],
)
def test_states(q, state, words):
    assert (state_of(q), words_of(q)) == (state, words)


def test_held_parameters_do_not_count():
    found = counted(
        [
            quantity(1.0, 0.9, 1.1),
            quantity(1.0, 0.1, 2.0),
            quantity(1.0, None, None),
            quantity(2.0, 2.0, 2.0, fixed=True),
        ]
    )
    assert (found.free, found.well, found.poorly, found.undetermined) == (3, 1, 1, 1)
    assert found.words == "1 of 3, 1 poorly, 1 not"
