"""Results as text and as HTML: numbers in the unit of the output, and nothing obeyed that comes from a file."""

from typing import Any

import numpy as np
import pytest

from mrfit.api.words import (
    Caution,
    PrintableResult,
    errors_of,
    frame_of,
    html_page,
    html_table,
    parameters_of,
    text_table,
)
from mrfit.io.schemas.determined import State
from mrfit.io.schemas.fit import Fit, MetricRow, Quantity, Result
from mrfit.report.determined import counted, measured, sentences, words_of

HOSTILE = "<b>\x1b[31m"


def quantity(
    name: str = "fy", value: float = 500.0, low: float | None = 490.0, high: float | None = 510.0, **given: Any
) -> Quantity:
    return Quantity(name=name, value=value, unit="N", text="", low=low, high=high, **given)


def fit(*metrics: MetricRow, results: tuple[Result, ...] = ()) -> Fit:
    return Fit(
        name="f", model="bingham", optimizer="lsq", per="all", settings={}, output="force", inputs=["velocity"],
        equation="", reference="", results=[*results], metrics=[*metrics], versions={},
    )  # fmt: skip


ROWS = (
    MetricRow(condition="all", role="train", samples=9, rmse=20.0, nrmse=0.01, fit_percent=98.0, noise_floor=2.0),
    MetricRow(condition="sine", role="holdout", samples=9),
)


def test_columns_of_numbers_have_nan_for_what_is_not_there_and_words_keep_none() -> None:
    frame = frame_of([{"a": 1, "b": "x"}, {"a": None, "c": 3}], ("a", "b"))
    assert list(frame.columns) == ["a", "b"] and np.isnan(frame["a"][1]) and frame["b"].isna().tolist() == [False, True]
    assert list(frame_of([{"n": "x", "a": 1}], ("n", "a"), "n").index) == ["x"]
    assert list(frame_of([], ("a", "b")).columns) == ["a", "b"]


def test_errors_are_in_the_output_s_unit_and_in_percent() -> None:
    first, second = errors_of(fit(*ROWS), ROWS).to_dict("records")
    assert (first["error"], first["of the range"], first["fit"]) == ("20.0 N", "1.00 %", "98.0 %")
    assert first["noise floor"] == "2.00 N" and (second["error"], second["fit"]) == ("– N", "– %")


def test_parameters_have_their_intervals_and_states() -> None:
    one = Result(condition="sine", evaluations=1, parameters=[quantity()], derived=[quantity("peak", 1.0, None, None)])
    rows = parameters_of(one).to_dict("records")
    assert rows[0] == {"parameter, sine": "fy", "value": "500 ± 10 N", "determined": "well"}
    assert rows[1]["value"] == "1.000 N"


def test_text_that_a_file_holds_is_shown_and_not_obeyed() -> None:
    frame = frame_of([{HOSTILE: HOSTILE, "a": 1.0}], (HOSTILE, "a"))
    assert "\x1b" not in text_table(frame) and "<b>" in text_table(frame)
    assert "\x1b" not in html_table(frame) and "<b>" not in html_table(frame)
    page = html_page(HOSTILE, ["<table></table>"], [HOSTILE])
    assert page.count("<b>") == 1 and "\x1b" not in page and "<table></table>" in page and "<li>" in page
    assert "<ul>" not in html_page("t", [], [])


def test_a_warning_names_its_condition_where_it_has_one() -> None:
    assert str(Caution("at-bound", "fy", "sine")) == "warning at-bound: sine: fy"
    assert str(Caution("at-bound", "fy")) == "warning at-bound: fy" and "\x1b" not in str(Caution("x", HOSTILE))


class Printed(PrintableResult):
    def _parts(self) -> Any:
        return "Title", [frame_of([{"a": 1.0}], ("a",))], ["said"]


def test_a_result_is_title_tables_and_sentences_either_way() -> None:
    text = repr(Printed())
    assert text.startswith("Title\n") and text.endswith("said") and "1" in text
    page = Printed()._repr_html_()
    assert page.startswith("<p><b>Title</b></p>") and "<li>said</li>" in page
    with pytest.raises(NotImplementedError):
        repr(PrintableResult())


@pytest.mark.parametrize(
    ("value", "low", "high", "shown"),
    [
        (500.0, 490.0, 510.0, "500 ± 10 N"),
        (500.0, 480.0, 700.0, "500 (480 to 700) N"),
        (500.0, None, 510.0, "500.0 N"),
        (500.0, 500.0, 500.0, "500 N"),
        (0.012, 0.011, 0.013, "12.0 ± 1.0 mN"),
        (1.0, -3.0, 5.0, "1.00 ± 4.0 N"),
    ],
)
def test_a_value_has_half_its_interval_or_both_ends(value: float, low: Any, high: Any, shown: str) -> None:
    assert measured(quantity(value=value, low=low, high=high)) == shown


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({}, ""),
        ({"fixed": True}, ""),
        ({"identifiable": False}, "not determined"),
        ({"low": 0.0, "high": 1000.0}, "poorly determined (its interval holds zero)"),
        ({"low": 100.0, "high": 900.0}, "poorly determined (± 80 %)"),
    ],
)
def test_the_state_of_a_parameter_in_words(given: dict[str, Any], words: str) -> None:
    assert words_of(quantity(**given)) == words


def test_parameters_are_counted_by_state_and_those_held_do_not_count() -> None:
    rows = [
        quantity(),
        quantity("c", low=100.0, high=900.0),
        quantity("f0", identifiable=False),
        quantity("k", fixed=True),
    ]
    assert counted(rows).words == "1 of 3, 1 poorly, 1 not" and counted(rows[:1]).words == "1 of 1"
    assert rows[1].determined is State.POORLY
    one = Result(condition="sine", evaluations=1, parameters=rows, derived=[quantity("d")])
    said = sentences(fit(results=(one,)))
    assert said == [
        "The data determine 1 of 3 parameters well, 1 poorly, 1 not; poorly: c (± 80 %).",
        "Derived quantities well determined: 1 of 1.",
    ]
    assert "poorly: c" not in sentences(fit(results=(one, one)))[0]
