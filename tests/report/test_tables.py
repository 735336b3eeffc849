import csv
import io
import re

import pytest

from mrfit.io.schemas.fit import Fit
from mrfit.report.source import read_source
from mrfit.report.tables import (
    METRIC_COLUMNS,
    PARAMETER_COLUMNS,
    metrics_csv,
    metrics_tex,
    parameters_csv,
    parameters_tex,
)


@pytest.fixture(scope="module")
def fits(coil, damper) -> list[Fit]:
    return [read_source(workspace, ()).fits[0] for workspace, _ in (coil, damper)]


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def test_one_fit_has_the_agreed_columns(fits):
    assert parameters_csv(fits[:1]).splitlines()[0] == ",".join(PARAMETER_COLUMNS)
    assert metrics_csv(fits[:1]).splitlines()[0] == ",".join(METRIC_COLUMNS)


def test_several_fits_are_told_apart_by_a_leading_column(fits):
    for table in (parameters_csv(fits), metrics_csv(fits)):
        assert table.startswith("fit,condition,")
        assert {r["fit"] for r in rows(table)} == {f.name for f in fits}


def test_parameters_carry_every_digit(fits):
    written = {(r["condition"], r["parameter"]): r for r in rows(parameters_csv(fits[:1]))}
    quantities = [(r.condition, q) for r in fits[0].results for q in [*r.parameters, *r.derived]]
    assert len(written) == len(quantities) == 15 * 7
    for condition, q in quantities:
        row = written[condition, q.name]
        assert float(row["value"]) == q.value
        assert (row["low"], row["high"]) == (("", "") if q.low is None else (repr(q.low), repr(q.high)))
        assert (row["at_bound"], row["identifiable"]) == (str(q.at_bound), str(q.identifiable))


def test_metrics_have_a_pooled_row_per_role(fits):
    table = rows(metrics_csv(fits[:1]))
    assert [(r["role"], r["samples"]) for r in table if r["condition"] == "all"] == [
        ("train", "24000"),
        ("holdout", "12000"),
    ]
    assert float(table[0]["rmse"]) == fits[0].metrics[0].rmse


def test_conditions_stand_in_natural_order(fits):
    named = list(dict.fromkeys(r["condition"] for r in rows(metrics_csv(fits[:1]))))
    assert named == [*(f"sine-{f}Hz-{a}A" for f in (1, 5, 10) for a in range(1, 6)), "all"]


@pytest.mark.parametrize("write", [parameters_tex, metrics_tex])
def test_latex_is_well_formed(fits, write):
    text = write(fits)
    assert re.findall(r"\\begin\{(\w+)\}", text) and text.count("{") - text.count(r"\{") == text.count(
        "}"
    ) - text.count(r"\}")
    open_environments: list[str] = []
    for kind, name in re.findall(r"\\(begin|end)\{(\w+)\}", text):
        if kind == "begin":
            open_environments.append(name)
        else:
            assert open_environments.pop() == name
    assert not open_environments
    assert text.count(r"\toprule") == text.count(r"\midrule") == text.count(r"\bottomrule")
    assert len(re.findall(r"(?<!\\)\$", text)) % 2 == 0


@pytest.mark.parametrize("write", [parameters_tex, metrics_tex])
def test_latex_rows_have_as_many_cells_as_columns(fits, write):
    columns = 0
    for line in write(fits).splitlines():
        if line.startswith(r"\begin{tabular}"):
            columns = len(line.removeprefix(r"\begin{tabular}{@{}").removesuffix("@{}}"))
        elif line.endswith(r" \\"):
            assert len(re.findall(r"(?<!\\)&", line)) == columns - 1


@pytest.mark.parametrize("write", [parameters_tex, metrics_tex])
def test_latex_is_plain_ascii_with_specials_escaped(fits, write):
    text = write(fits)
    assert text.isascii()
    assert not re.search(r"(?<!\\)[%#]", text)
    assert not re.search(r"(?<![\\$}])_(?!\{)", re.sub(r"\\label\{[^}]*\}", "", text))


def test_latex_marks_bounds_and_what_is_not_determined(fits):
    line = next(n for n in parameters_tex(fits[:1]).splitlines() if n.startswith("sine-1Hz-1A"))
    assert line == r"sine-1Hz-1A & 1.210$^{\dagger}$ & 0.02246 & 3.500$^{\dagger}$ & 1.000$^{\ast}$ & 20 \\"


def test_joint_fit_is_set_out_one_parameter_a_row(fits):
    text = parameters_tex(fits[1:])
    assert r"$f_{y}$ & yield force $<$at rest$>$ & 1300 & [1288, 1312] & N \\" in text
    assert r"$C_{\infty}$ & what C\_inf is & 3012 & [2972, 3052] & N\,s/m \\" in text
