import json
from dataclasses import replace

import pytest

from mrfit.io.schemas.determined import State
from mrfit.io.schemas.fit import Quantity
from mrfit.io.schemas.reading import of_json
from mrfit.io.workspace import plain
from mrfit.report.determined import counted, measured, words_of


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
        # not even the sign of an offset is known, however wide its bounds are
        (quantity(5.7, -53.0, 64.0, (-1e5, 1e5)), State.POORLY, "poorly determined (its interval holds zero)"),
        (quantity(0.0, -1.0, 1.0, (-1e5, 1e5)), State.POORLY, "poorly determined (its interval holds zero)"),
        (quantity(-20.0, -24.0, -16.0, (-1e5, 1e5)), State.WELL, ""),
        (quantity(0.2, 0.1, 0.3, (0.1, 50.0)), State.POORLY, "poorly determined (± 50 %)"),
        # an offset is judged by the range that it adds to
        (quantity(0.4, -2.0, 2.8, added_to=1000.0), State.WELL, ""),
        (quantity(5.7, -53.0, 64.0, added_to=1000.0), State.POORLY, "poorly determined (its interval holds zero)"),
        (quantity(200.0, 160.0, 240.0, added_to=1000.0), State.WELL, ""),
        (quantity(0.4, None, 2.8, added_to=1000.0), State.POORLY, "poorly determined"),
        # 18 800 1/m between 2 500 and 143 000, whatever its unit makes of the logarithm
        (quantity(9.84, 7.82, 11.87, logarithm=True), State.POORLY, "poorly determined (± 202 %)"),
        (quantity(0.05, -0.05, 0.15, logarithm=True), State.WELL, ""),
    ],
)
def test_states(q, state, words):
    assert (q.determined, words_of(q)) == (state, words)


@pytest.mark.parametrize(
    ("value", "half", "shown"),
    [
        (-6.4e-9, 381e-6, "0 ± 381 µs"),
        (-5e-6, 381e-6, "-5.00 ± 381 µs"),
        (0.0, 0.25, "0 ± 0.25 s"),
        (0.02006, 0.00016, "20.06 ± 0.16 ms"),
    ],
)
def test_a_value_that_is_nothing_within_its_interval_is_0_in_the_unit_of_the_interval(value, half, shown):
    assert measured(quantity(value, value - half, value + half, unit="s")) == shown.replace("-", "−")


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


def test_files_hold_the_word_and_reading_judges_anew():
    row = quantity(10.0, 9.0, 11.0)
    text = json.dumps(plain(row))
    assert json.loads(text)["determined"] == "well"
    assert of_json(Quantity, text.replace("11.0", "19.0")).determined is State.POORLY
    assert replace(row, low=None).determined is State.POORLY
