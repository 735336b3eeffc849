"""The discovery's page: what the discover stage wrote in, one HTML file that opens offline out."""

import hashlib
from importlib.metadata import version
from pathlib import Path
from typing import Any

from mrfit.core import registry
from mrfit.core.progress import Progress, silent
from mrfit.io.keys import discovery_key, key_of
from mrfit.io.outdated import Inputs
from mrfit.io.schemas.discovery import DiscoveryFile
from mrfit.io.workspace import Workspace, write_text
from mrfit.report import page
from mrfit.report.curves import prefixed
from mrfit.report.discovery_figures import figures_of
from mrfit.report.discovery_source import Discovery, files_of, read_discovery, read_found
from mrfit.report.explain import closed_share, effect_words, headline, next_step, parameter_rows, sentences
from mrfit.report.numbers import in_html, percent, significant
from mrfit.report.page import number, template_of
from mrfit.report.svg import inline
from mrfit.simulate.current_dependence import form_of

TEMPLATE = Path(__file__).with_name("discovery.html.jinja")
UNJUDGED = "cannot be judged"
# Cosine above which two effects could nearly take each other's place


def run(workspace: Workspace, progress: Progress = silent) -> dict[str, Any]:
    """Write ``discover/discovery.html``.

    Parameters
    ----------
    workspace
        Holds a discovery.
    progress
        Told of the page.

    Returns
    -------
    dict
        ``page``, its path, and ``skipped``: whether it was there and nothing it shows had changed.

    Raises
    ------
    DataError
        If there is no discovery, or its files cannot be read or written.
    """
    path = workspace.root / "discover" / "discovery.html"
    read_found(workspace)
    key = _key(workspace)
    if path.is_file() and f'content="{key}"' in path.read_text(encoding="utf-8", errors="replace")[:1000]:
        return {"page": str(path), "skipped": True}
    progress("page", 0, 1)
    write_text(path, render(read_discovery(workspace), key))
    progress("page", 1, 1)
    return {"page": str(path), "skipped": False}


def advice(workspace: Workspace) -> dict[str, Any]:
    """Return the last discovery's verdict, which tests would settle what it left open, and whether it is ``outdated``.

    Raises
    ------
    DataError
        If there is no discovery.
    """
    found = read_found(workspace)
    outdated = bool(Inputs(workspace).reason(DiscoveryFile.of(found), discovery_key)) if found["settings"] else False
    return {k: found[k] for k in ("base_model", "verdict", "ambiguous_set", "advice")} | {"outdated": outdated}


def _key(workspace: Workspace) -> str:
    inputs = [TEMPLATE, page.STYLE, *(p for p in files_of(workspace) if p.is_file())]
    hashes = [(p.name, hashlib.sha256(p.read_bytes()).hexdigest()) for p in inputs]
    return key_of("discovery page", hashes, version("matplotlib"), version("jinja2"))


def render(discovery: Discovery, key: str) -> str:
    """Return the page of a discovery; ``key`` is kept in it."""
    found = discovery.found
    drawn = [{"figure": f, "svg": inline(f.svg, f"f{k}", f.alt)} for k, f in enumerate(figures_of(discovery), start=1)]
    return template_of(TEMPLATE).render(
        found=found,
        key=key,
        headline=headline(found),
        sentences=sentences(found),
        effects=[_effect(e) for e in found["effects"]],
        suspects=[effect_words(name) for name in found["ambiguous_set"]],
        suspected=[_suspect(row) for row in found.get("suspects", [])],
        advice=found["advice"],
        figures=drawn,
        candidates=[_candidate(c) for c in found["candidates"]],
        matrix=confusion(found),
        facts=_facts(discovery),
        command=next_step(found),
        version=version("mrfit"),
    )


def _effect(effect: dict[str, Any]) -> dict[str, Any]:
    errors = {"without": effect["holdout_nrmse_before"], "with": effect["holdout_nrmse_after"]}
    shares = {k: {"exact": repr(v), "shown": percent(v)} for k, v in errors.items()}
    return {"name": effect["name"], "rows": parameter_rows(effect), **shares}


def _suspect(row: dict[str, Any]) -> dict[str, Any]:
    after = row["holdout_nrmse_after"]
    name = f"{row['name']} instead of {row['instead_of']}" if "instead_of" in row else row["name"]
    return {"name": name, "rows": parameter_rows(row), "with": {"exact": repr(after), "shown": percent(after)}}


def _candidate(row: dict[str, Any]) -> dict[str, Any]:
    gain = row["holdout_gain"]
    return {
        **row,
        "title": registry.load("effect", row["name"]).SPEC.title,
        "screen": number(row["screen"], significant(100.0 * row["screen"])),
        "holdout_gain": number(gain, "" if gain is None else closed_share(gain)),
    }


def confusion(found: dict[str, Any]) -> dict[str, Any]:
    """Return the cosines between what the effects judged do, as rows of a lower triangle, and which were not judged.

    A cell is its text and whether the two are alike, which they are above what the discovery took for it.
    """
    table = found.get("cosines") or {"names": [], "matrix": []}
    names, matrix, alike = table["names"], table["matrix"], table.get("alike", 1.0)
    rows = [
        {"name": name, "cells": [(in_html(f"{c:.3f}"), abs(c) > alike) for c in matrix[k][:k]]}
        for k, name in enumerate(names)
    ]
    return {
        "names": names,
        "alike": f"{alike:g}",
        "rows": rows,
        "alone": [n for k, n in enumerate(names) if all(abs(c) <= alike for j, c in enumerate(matrix[k]) if j != k)],
        "unjudged": [(c["name"], c["reason"]) for c in found["candidates"] if c["reason"].startswith(UNJUDGED)],
    }


def _facts(discovery: Discovery) -> list[tuple[str, str]]:
    found = discovery.found
    parts = len(discovery.parts)
    held = len(discovery.conditions("holdout"))
    samples = sum(len(p.measured) for p in discovery.parts)
    floor = found["gap"]["noise_floor"]
    facts = [
        ("Base model", found["base_model"]),
        ("Augmented model", found["augmented_model"]),
        ("Predicts", discovery.output),
        ("Depends on current", _dependence(found.get("current_dependence"))),
        ("Data", f"{parts} segments, {samples} samples; {held} held-out conditions" if parts else ""),
        ("Output's range", _physical(discovery.span, discovery) if parts else ""),
        ("Noise floor", _physical(floor * discovery.span, discovery) if parts and floor else ""),
        ("Seed", str(found["seed"])),
        ("Data hash", f"SHA-256 {found['data_sha256'][:16]}…" if found["data_sha256"] else ""),
        ("Program", f"mrfit {version('mrfit')}"),
    ]
    return [(label, text) for label, text in facts if text]


def _physical(value: float, discovery: Discovery) -> str:
    factor, unit = prefixed(value, discovery.unit)
    return f"{in_html(significant(factor * value))} {unit}".strip()


def _dependence(dependence: dict[str, Any] | None) -> str:
    """Return how the base's parameters depend on current, as in ``fy of order 2, c of order 2, 0 to 2 A``."""
    if not dependence:
        return ""
    orders = dependence["orders"]
    items = orders.items() if isinstance(orders, dict) else orders
    varied = ", ".join(f"{name} of order {_order(order)}" for name, order in items if order)
    return f"{varied}, {dependence['low']:g} to {dependence['high']:g} A"


def _order(order: int | str) -> str:
    """Return an order in words, the form it was chosen in behind it: ``2 (log)``."""
    form = form_of(order)
    return f"{str(order).removeprefix(form)} ({form})" if form else str(order)
