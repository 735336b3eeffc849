"""The key of a report: a hash of all that goes into it, computed without what draws it."""

import hashlib
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path

from mrfit.io.keys import key_of
from mrfit.io.workspace import Workspace

REPORT_TEMPLATE = Path(__file__).with_name("index.html.jinja")
STYLE_SHEET = Path(__file__).with_name("style.css.jinja")
PARTS = tuple(
    Path(__file__).with_name(name)
    for name in ("index.html.jinja", "style.css.jinja", "page.js.jinja", "fit.html.jinja", "ranking.html.jinja")
)
"""What a page is made with beside the code."""
TABLE_FORMATS = (".parquet", ".csv")
"""Of the series of a saved prediction."""


def report_key(workspace: Workspace, names: list[str], outdated: Mapping[str, str], code: str = "") -> str:
    """Return the key of all that goes into a report of these fits; the page's template is none of the hashed sources.

    ``outdated`` says why some of them are out of date. ``code`` is the version of the code that makes it; default: this
    one.
    """
    inputs = [*PARTS, *input_files(workspace, names), *prediction_files(workspace)]
    hashes = [(p.name, hashlib.sha256(p.read_bytes()).hexdigest()) for p in inputs]
    old = [dict(outdated)] if outdated else []
    return key_of(names, hashes, version("matplotlib"), version("jinja2"), *old, code=code)


def input_files(workspace: Workspace, names: list[str]) -> list[Path]:
    """Return every file the report of these fits depends on, those that exist."""
    folders = [workspace.fit_folder(n) for n in names]
    files = [f / name for f in folders for name in ("fit.json", "residuals.parquet")]
    return [p for p in [*files, workspace.ingest_json, workspace.flux_json, workspace.segments_file] if p.is_file()]


def prediction_files(workspace: Workspace) -> list[Path]:
    """Return the summaries and series of saved predictions."""
    folder = workspace.root / "predict"
    return [p for p in sorted(folder.glob("*")) if p.suffix in (".json", *TABLE_FORMATS) and not p.name.startswith(".")]
