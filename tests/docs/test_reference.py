"""The generated pages say what the code says: schemas, thresholds, figures, and plain text in Markdown."""

from dataclasses import fields

import numpy as np
import pytest

from docs.reference import commands, figures, policy, schemas
from docs.reference.markdown import documented, plain
from mrfit.core.built_in import own_names
from mrfit.discover.policy import STANDARD, Policy
from mrfit.io.schemas.fit import Fit
from tests.conftest import ROOT


def test_every_file_of_a_workspace_is_described_with_its_schema_and_keys() -> None:
    text = schemas.page()
    partial = {n for n in schemas.documents() if n.startswith("Partial")}
    assert {*schemas.FILES} == {*schemas.documents()} - partial
    for kind in schemas.documents().values():
        assert all(f"`{schema}`" in text for schema in kind.known)
    section = text.split("## Fit\n")[1].split("\n## ")[0]
    assert all(f"| `{f.name}` |" in section for f in fields(Fit))
    assert "W/fits/NAME" in text


def test_a_key_has_its_type_default_and_meaning() -> None:
    text = schemas.page()
    assert "| `seed` | whole number or null | `null` |" in text
    assert "| `current_dependence` | FitDependence or null |" in text
    section = text.split("### Repeats\n")[1].split("\n### ")[0]
    assert "| `agree` | true or false |  | Whether one set of parameters can follow them all. |" in section


def test_every_threshold_is_listed_with_its_value_and_what_set_it() -> None:
    rows = {r.split("`")[1]: r for r in policy.page().split("\n")[2:] if r}
    assert list(rows) == [f.name for f in fields(Policy)]
    for name, row in rows.items():
        value, meaning, what_set_it = (cell.strip() for cell in row.split(" | ")[1:4])
        assert [float(v) for v in value.split(",")] == pytest.approx(np.atleast_1d(getattr(STANDARD, name)), rel=1e-5)
        assert len(meaning) > 5 and what_set_it, name


def test_every_option_is_listed_with_its_default() -> None:
    section = commands.page().split("\n## mrfit flux\n")[1].split("\n## ")[0]
    assert "| `--drift` | `cycle` |" in section and "`--resistance`" in section
    assert "mrfit apply track" in commands.page()


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("kappa*|z|^n and a_b", r"kappa\*\|z\|\^n and a\_b"),
        ("``a*b`` of <x>", r"`a*b` of \<x\>"),
    ],
)
def test_what_means_something_to_markdown_is_shown(text: str, shown: str) -> None:
    assert plain(text) == shown


def test_a_docstring_keeps_its_equation_as_a_block() -> None:
    assert documented("One.\n\n    F = c*v\n\nc damping.\n") == "One.\n\n```text\nF = c*v\n```\n\nc damping."


@pytest.mark.slow
@pytest.mark.parametrize("name", own_names("effect"))
def test_a_figure_shows_an_effect_at_the_stated_strength(name: str) -> None:
    model, _, without, changed = figures.effect(name)
    shown = slice(-round(figures.SHOWN / figures.DT), None)
    difference = (changed - without)[shown]
    difference = difference - difference.mean() * (model.spec.output == "flux")
    share = np.sqrt(np.mean(difference**2)) / np.ptp(without[shown])
    # one that cannot move the output so far is shown at its bound
    assert 0.02 < share < 1.05 * figures.MOVED


def test_every_reader_is_named_on_the_page_of_formats() -> None:
    page = (ROOT / "docs" / "formats.md").read_text(encoding="utf-8")
    assert not [name for name in own_names("reader") if f"`{name}`" not in page]
