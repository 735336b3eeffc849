"""The discovery's page: what the discover stage wrote in, one HTML file that opens offline out."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from mrfit.core import registry
from mrfit.core.counting import number_of
from mrfit.core.progress import Progress, silent
from mrfit.io.keys import discovery_key, key_of
from mrfit.io.outdated import Inputs
from mrfit.io.schemas.discovery import (
    Candidate,
    Confounded,
    Cosines,
    DiscoveryDependence,
    DiscoveryFile,
    FoundEffect,
    InvariantEffect,
    Suspect,
)
from mrfit.io.workspace import Workspace, write_text
from mrfit.report.curves import prefixed
from mrfit.report.discovery_figures import figures_of, taken_by
from mrfit.report.discovery_source import Discovery, files_of, read_discovery, read_found
from mrfit.report.explain import (
    UNJUDGED,
    ParameterText,
    closed_share,
    effect_words,
    headline,
    next_step,
    parameter_rows,
    sentences,
    takes_of,
)
from mrfit.report.key import STYLE
from mrfit.report.law_words import law_sentences, nearer_law, other_base_sentences
from mrfit.report.numbers import in_html, percent, significant
from mrfit.report.page import template_of
from mrfit.report.svg import inline
from mrfit.simulate.current_dependence import form_of

TEMPLATE = Path(__file__).with_name("discovery.html.jinja")


@dataclass(frozen=True)
class Page:
    """Path of the page, and whether it was there already and nothing it shows had changed."""

    path: Path
    skipped: bool = False


@dataclass(frozen=True)
class Advice:
    """Tests that would settle what a discovery left open, whether it is out of date, and why."""

    base_model: str
    verdict: str
    ambiguous_set: tuple[str, ...]
    advice: tuple[str, ...]
    outdated: bool
    reason: str


def run(workspace: Workspace, progress: Progress = silent) -> Page:
    """Write ``discover/discovery.html``.

    Parameters
    ----------
    workspace
        Holds a discovery.
    progress
        Reports the page.

    Raises
    ------
    DataError
        If there is no discovery, or its files cannot be read or written.
    """
    path = workspace.root / "discover" / "discovery.html"
    read_found(workspace)
    key = _key(workspace)
    if path.is_file() and f'content="{key}"' in path.read_text(encoding="utf-8", errors="replace")[:1000]:
        return Page(path, skipped=True)
    progress("page", 0, 1)
    write_text(path, render(read_discovery(workspace), key))
    progress("page", 1, 1)
    return Page(path)


def advice(workspace: Workspace) -> Advice:
    """Return the last discovery's verdict, and which tests would settle what it left open.

    Raises
    ------
    DataError
        If there is no discovery.
    """
    found = read_found(workspace)
    reason = Inputs(workspace).reason(found, discovery_key, "discover") if found.settings else ""
    return Advice(found.base_model, found.verdict, found.ambiguous_set, found.advice, bool(reason), reason)


def _key(workspace: Workspace) -> str:
    inputs = [TEMPLATE, STYLE, *(p for p in files_of(workspace) if p.is_file())]
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
        sentences=sentences(found, law=False),
        effects=[_effect(e) for e in found.effects],
        suspects=[effect_words(name) for name in found.ambiguous_set],
        suspected=[_suspect(found, row) for row in found.suspects],
        advice=found.advice,
        figures=drawn,
        candidates=[_candidate(found, c) for c in found.candidates],
        matrix=confusion(found.cosines, found.candidates),
        facts=_facts(discovery),
        law=_law(found),
        nearer=nearer_law(found),
        command=next_step(found),
        version=version("mrfit"),
    )


@dataclass(frozen=True)
class Number:
    """A number with all its digits, for copying, and as it is shown."""

    exact: str | None
    shown: str


@dataclass(frozen=True)
class EffectRow:
    """An effect as the page shows it, with the errors without it and with it."""

    name: str
    rows: list[ParameterText]
    error: Number
    error_without: Number


@dataclass(frozen=True)
class SuspectRow:
    """An effect that is not named, and the share of the squared error that it takes on held-out conditions."""

    name: str
    rows: list[ParameterText]
    takes: Number


@dataclass(frozen=True)
class CandidateRow:
    """A candidate as the page shows it: the share of the squared error that it takes, and how that was found."""

    row: Candidate
    title: str
    takes: Number
    judged: str


def _share(share: float | None) -> Number:
    return Number(repr(share), percent(share))


def _percentage(share: float | None, text: str) -> Number:
    return Number(None if share is None else repr(share), in_html(text))


def _effect(effect: FoundEffect) -> EffectRow:
    errors = (_share(effect.holdout_nrmse_after), _share(effect.holdout_nrmse_before))
    return EffectRow(effect.name, parameter_rows(effect), *errors)


def _suspect(found: DiscoveryFile, row: Suspect) -> SuspectRow:
    name = f"{row.name} instead of {row.instead_of}" if row.instead_of else row.name
    # effects that were taken back would take their share together
    takes = taken_by(found, row.name) if found.ambiguous_set else None
    return SuspectRow(name, parameter_rows(row), _taken(row.closed if takes is None else takes))


def _taken(share: float | None) -> Number:
    return _percentage(share, "" if share is None else closed_share(share))


def _candidate(found: DiscoveryFile, row: Candidate) -> CandidateRow:
    share, shown, judged = takes_of(found, row)
    exact = None if share is None else repr(share)
    return CandidateRow(row, registry.load("effect", row.name).SPEC.title, Number(exact, shown), judged)


@dataclass(frozen=True)
class TestedRow:
    """An effect that was tested against any law, as the page shows it."""

    name: str
    breaks: str
    named: bool
    numbers: tuple[Number, ...]
    reason: str


@dataclass(frozen=True)
class LawRow:
    """Another law as the page shows it."""

    model: str
    numbers: tuple[Number, ...]
    command: str


@dataclass(frozen=True)
class Law:
    """Content of the page on effects beside an open law."""

    sentences: list[str]
    tested: tuple[TestedRow, ...] = ()
    others: tuple[LawRow, ...] = ()
    confounded: tuple[Confounded, ...] = ()


def _law(found: DiscoveryFile) -> Law:
    examined = found.invariance
    tested: list[TestedRow] = []
    if examined is not None:
        tested = [_tested(e, e in examined.named) for e in (*examined.named, *examined.turned_down)]
    others = tuple(
        LawRow(
            o.model,
            (_of_hundred(o.takes), _of_hundred(o.takes_beside), _percentage(o.floors, significant(o.floors))),
            o.command,
        )
        for o in found.other_laws
    )
    again = other_base_sentences(found)
    return Law([*law_sentences(found), *again], tuple(tested), others, found.confounded)


def _tested(effect: InvariantEffect, named: bool) -> TestedRow:
    s = effect.standing
    shares = (s.share, s.kept, s.held) if s else (None, None, None)
    numbers = (*map(_of_hundred, shares), _percentage(s.z if s else None, significant(s.z) if s else ""))
    reason = effect.reason or ("one of a set" if effect.one_of else "no law makes what it does")
    return TestedRow(effect.name, effect.breaks, named, numbers, reason)


def _of_hundred(share: float | None) -> Number:
    return _percentage(share, "" if share is None else significant(100.0 * share))


@dataclass(frozen=True)
class CosineCell:
    """A cosine as text, and whether the discovery took the two effects for alike."""

    text: str
    alike: bool


@dataclass(frozen=True)
class Confusion:
    """Effects that the data confuse.

    Attributes
    ----------
    names
        Effects that were judged.
    alike
        The cosine above which two are alike, as text.
    rows
        For each of them the cells to those before it: a lower triangle.
    alone
        Effects that are like no other.
    unjudged
        Effects that could not be judged.
    """

    names: tuple[str, ...]
    alike: str
    rows: tuple[tuple[CosineCell, ...], ...]
    alone: tuple[str, ...]
    unjudged: tuple[Candidate, ...]


def confusion(cosines: Cosines | None, candidates: Sequence[Candidate]) -> Confusion:
    """Return the cosines between what the effects judged do, and which were not judged."""
    table = cosines or Cosines(names=(), matrix=())
    names, matrix, alike = table.names, table.matrix, table.alike
    return Confusion(
        names=names,
        alike=f"{alike:g}",
        rows=tuple(
            tuple(CosineCell(in_html(f"{c:.3f}"), abs(c) > alike) for c in matrix[k][:k]) for k in range(len(names))
        ),
        alone=tuple(n for k, n in enumerate(names) if all(abs(c) <= alike for j, c in enumerate(matrix[k]) if j != k)),
        unjudged=tuple(c for c in candidates if c.reason.startswith(UNJUDGED)),
    )


def _facts(discovery: Discovery) -> list[tuple[str, str]]:
    found = discovery.found
    parts = len(discovery.parts)
    held = len(discovery.conditions("holdout"))
    samples = sum(len(p.measured) for p in discovery.parts)
    floor = found.gap.noise_floor
    facts = [
        ("Base model", found.base_model),
        ("Augmented model", found.augmented_model),
        ("Predicts", discovery.output),
        ("Depends on current", _dependence(found.current_dependence)),
        (
            "Data",
            f"{number_of('segment', parts)}, {samples} samples; {number_of('held-out condition', held)}"
            if parts
            else "",
        ),
        ("Output's range", _physical(discovery.span, discovery) if parts else ""),
        ("Noise floor", _physical(floor * discovery.span, discovery) if parts and floor else ""),
        ("Errors", "RMS over the output's range in all conditions; `mrfit compare` divides by that of held-out ones"),
        ("Seed", str(found.seed)),
        ("Data hash", f"SHA-256 {found.data_sha256[:16]}…" if found.data_sha256 else ""),
        ("Program", f"mrfit {version('mrfit')}"),
    ]
    return [(label, text) for label, text in facts if text]


def _physical(value: float, discovery: Discovery) -> str:
    factor, unit = prefixed(value, discovery.unit)
    return f"{in_html(significant(factor * value))} {unit}".strip()


def _dependence(dependence: DiscoveryDependence | None) -> str:
    """Return the orders of the base's parameters over current, as in ``fy of order 2, c of order 2, 0 to 2 A``."""
    if not dependence:
        return ""
    varied = ", ".join(f"{name} of order {_order(order)}" for name, order in dependence.orders if order)
    return f"{varied}, {dependence.low:g} to {dependence.high:g} A"


def _order(order: int | str) -> str:
    """Return an order in words, the form it was chosen in behind it: ``2 (log)``."""
    form = form_of(order)
    return f"{str(order).removeprefix(form)} ({form})" if form else str(order)
