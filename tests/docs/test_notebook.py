"""The notebook of the tutorials: its cells run without Jupyter, and show what it says."""

import ast
import json
from typing import Any

from tests.conftest import ROOT

NOTEBOOK = ROOT / "docs" / "tutorials" / "notebook.ipynb"
LINES = 12


def test_the_cells_of_the_notebook_run_and_end_with_a_band() -> None:
    cells = [c for c in json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"] if c["cell_type"] == "code"]
    # outputs are made by the build of the pages
    assert not any(c["outputs"] for c in cells)
    names: dict[str, Any] = {}
    shown = []
    for cell in cells:
        tree = ast.parse("".join(cell["source"]))
        *body, last = tree.body
        if not isinstance(last, ast.Expr):
            body.append(last)
        exec(compile(ast.Module(body, []), str(NOTEBOOK), "exec"), names)
        if isinstance(last, ast.Expr):
            shown.append(eval(compile(ast.Expression(last.value), str(NOTEBOOK), "eval"), names))
    fit, figure, band, coverage = shown
    assert "<table" in fit._repr_html_() and figure._repr_png_().startswith(b"\x89PNG")
    assert {"low", "high", "low_parameters", "high_parameters"} <= set(band)
    assert 0.93 <= coverage <= 1.0
    # without the cell that makes the data
    lines = [line for cell in cells[1:] for line in "".join(cell["source"]).splitlines() if line.strip()]
    assert len(lines) <= LINES
