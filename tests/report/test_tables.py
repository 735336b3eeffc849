import csv
import io
import re
import shutil
import subprocess
from dataclasses import replace

import pytest

from mrfit.io.schemas.fit import Fit, Level
from mrfit.report.latex import HEAD, with_uncertainty
from mrfit.report.source import read_source
from mrfit.report.tables import (
    METRIC_COLUMNS,
    PARAMETER_COLUMNS,
    comparison_csv,
    comparison_tex,
    fit_tex,
    metrics_csv,
    parameters_csv,
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
        assert (row["at_bound"], row["determined"]) == (str(q.at_bound), q.determined)


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


@pytest.fixture(scope="module", params=["coil", "damper", "comparison"])
def latex(fits, request) -> str:
    text = comparison_tex(fits) if request.param == "comparison" else fit_tex(fits[request.param == "damper"])
    assert text.startswith(HEAD)
    return text.removeprefix(HEAD)


def test_latex_is_well_formed(latex):
    assert latex.count("{") - latex.count(r"\{") == latex.count("}") - latex.count(r"\}")
    open_environments: list[str] = []
    for kind, name in re.findall(r"\\(begin|end)\{(\w+\*?)\}", latex):
        if kind == "begin":
            open_environments.append(name)
        else:
            assert open_environments.pop() == name
    assert not open_environments
    assert latex.count(r"\toprule") == latex.count(r"\midrule") == latex.count(r"\bottomrule") > 0
    assert len(re.findall(r"(?<!\\)\$", latex)) % 2 == 0


def test_latex_rows_have_as_many_cells_as_columns(latex):
    columns = 0
    for line in latex.splitlines():
        if line.startswith(r"\begin{tabular}"):
            align = line.removeprefix(r"\begin{tabular}{@{}").removesuffix("@{}}")
            columns = len(re.sub(r"\{[^}]*\}", "", align))
        elif line.endswith(r" \\"):
            assert len(re.findall(r"(?<!\\)&", line)) == columns - 1


def test_latex_is_plain_ascii_with_specials_escaped(latex):
    assert latex.isascii()
    assert not re.search(r"(?<!\\)[%#]", latex)
    assert not re.search(r"(?<![\\$}])_(?!\{)", re.sub(r"\\label\{[^}]*\}|\$[^$]*\$", "", latex))


def test_latex_marks_bounds_and_what_is_not_determined(fits):
    text = fit_tex(fits[0])
    line = next(n for n in text.splitlines() if "1Hz-\\allowbreak{}1A &" in n)
    assert r"\mrfitnumber{1.210}{}$^{\dagger}$ & \mrfitvalue{0.02246}{21}{0.00021}{} & " in line
    assert r"\mrfitvalue{1.000}{50}{0.050}{}$^{\ast}$ & \mrfitnumber{20}{}$^{\S}$ \\" in line
    assert r"$^{\dagger}$ not determined by the data" in text and "poorly" not in text


def test_joint_fit_is_set_out_one_parameter_a_row(fits):
    text = fit_tex(fits[1])
    assert r"$f_{y}$ & \raggedright\hspace{0pt}yield force $<$at rest$>$ & N & \mrfitvalue{1300}{12}{12}{} \\" in text
    assert r"$C_\infty$ & \raggedright\hspace{0pt}what C\_inf is & N\,s/m & \mrfitvalue{3012}{40}{40}{} \\" in text


@pytest.mark.parametrize("of", [" of ln(a1)", " of c"])
def test_a_coefficient_of_a_logarithm_is_told_as_one(fits, of):
    row = replace(fits[1].results[0].parameters[0], name="a1.i0", text=f"coefficient of i^0{of}")
    text = fit_tex(replace(fits[1], results=[replace(fits[1].results[0], derived=[row])]))
    assert "coefficient of $i^0$" in text and ("of ln(a1)" in text) == ("ln" in of)


def at_currents(fit: Fit) -> Fit:
    first, *_ = fit.results[0].parameters
    values = {0.0: 100.0, 1.0: 400.0, 2.5: 650.0}
    moved = [
        replace(first, name=f"fy@{i:g}A", text=f"yield force at {i:g} A", value=v, low=v - 9.0, high=v + 9.0)
        for i, v in values.items()
    ]
    return replace(fit, results=[replace(fit.results[0], parameters=[*moved, fit.results[0].parameters[1]])])


def test_currents_are_columns(fits):
    text = fit_tex(at_currents(fits[1]))
    assert r"Symbol & Meaning & Unit & constant & $0$\,A & $1$\,A & $2.5$\,A \\" in text
    row = next(n for n in text.splitlines() if n.startswith("$f_{y}$"))
    assert "yield force & N &  & " in row and row.count("mrfitvalue") == 3 and "{400.0}{90}{9.0}" in row
    constant = next(n for n in text.splitlines() if n.startswith(r"$C_\infty$"))
    assert constant.endswith(r"\mrfitvalue{3012}{40}{40}{} &  &  &  \\")


def test_sets_that_differ_in_current_alone_stand_side_by_side(fits):
    results = [
        replace(fits[1].results[0], condition=f"c{i}", at=Level(frequency=2.0, amplitude=0.01, current=i))
        for i in (1.0, 0.0)
    ]
    text = fit_tex(replace(fits[1], results=results))
    assert r"Symbol & Meaning & Unit & $0$\,A & $1$\,A \\" in text
    other = replace(results[1], at=Level(frequency=5.0, amplitude=0.01, current=0.0))
    assert "Condition & $f_{y}$ & " in fit_tex(replace(fits[1], results=[results[0], other]))


def test_the_comparison_has_errors_criteria_and_what_is_not_determined(fits):
    second = replace(fits[1], name="second_one")
    text = comparison_tex([fits[1], second])
    assert r"$\Delta$AIC & $\Delta$BIC" in text and r"second\_one & 2 & 0 & " in text
    (first, other) = rows(comparison_csv([fits[1], second]))
    assert first["fit"] == fits[1].name and (first["parameters"], first["well"]) == ("2", "2")
    assert float(first["holdout_nrmse"]) == fits[1].pooled("holdout").nrmse
    assert first["held_out"] == "conditions" and first["aic"] == other["aic"]


@pytest.mark.parametrize(
    ("interval", "latex"),
    [
        ((100.0, 98.0, 102.0), r"\mrfitvalue{100.0}{20}{2.0}{}"),
        ((1.5e-7, 1.4e-7, 1.6e-7), r"\mrfitvalue{1.50}{10}{0.10}{-7}"),
        ((100.0, 98.0, 106.0), "$100.0^{+6.0}_{-2.0}$"),
        ((100.0, None, 106.0), r"\mrfitnumber{100.0}{}"),
        ((-3.25, -3.5, -3.0), r"\mrfitvalue{-3.25}{25}{0.25}{}"),
    ],
)
def test_digits_follow_the_interval(interval, latex):
    assert with_uncertainty(*interval).latex == latex


@pytest.mark.skipif(not shutil.which("pdflatex"), reason="pdflatex is not installed")
@pytest.mark.parametrize("columns", ["onecolumn", "twocolumn"])
def test_tables_compile_without_an_overfull_box(fits, tmp_path, columns):
    """In two columns numbers are set by siunitx, where that is installed."""
    found = shutil.which("kpsewhich") and subprocess.run(["kpsewhich", "siunitx.sty"], capture_output=True).stdout
    siunitx = r"\usepackage{siunitx}" if columns == "twocolumn" and found else ""
    wide = [
        replace(q, name=f"W1_{k}", value=-1.234567e-5, low=-1.3e-5, high=-1.2e-5)
        for k, q in enumerate([fits[0].results[0].parameters[1]] * 14)
    ]
    many = replace(fits[0], name="many", results=[replace(r, parameters=wide) for r in fits[0].results * 3])
    shown = [*fits, at_currents(fits[1]), many]
    for k, fit in enumerate(shown):
        (tmp_path / f"t{k}.tex").write_text(fit_tex(fit))
    (tmp_path / "c.tex").write_text(
        comparison_tex([replace(f, name=f"{f.name}.{'long-name.' * k}") for k, f in enumerate(shown)])
    )
    inputs = "".join(rf"\input{{{name}}}\clearpage" for name in ["c", *(f"t{k}" for k in range(len(shown)))])
    (tmp_path / "paper.tex").write_text(
        rf"\documentclass[10pt,a4paper,{columns}]{{article}}\usepackage{{booktabs}}{siunitx}"
        rf"\begin{{document}}{inputs}\end{{document}}"
    )
    subprocess.run(["pdflatex", "-interaction=nonstopmode", "paper.tex"], cwd=tmp_path, capture_output=True)
    log = (tmp_path / "paper.log").read_text(encoding="latin-1")
    assert "Output written on paper.pdf" in log
    assert not re.findall(r"^(?:Overfull.*|! .*|.*Float too large.*)$", log, flags=re.MULTILINE)
