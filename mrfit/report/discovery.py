"""The discovery's page: what the discover stage wrote in, one HTML file that opens offline out."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from markupsafe import Markup, escape

from mrfit.core import registry
from mrfit.core.counting import number_of
from mrfit.core.progress import Progress, silent
from mrfit.io.keys import discovery_key, key_of
from mrfit.io.outdated import Inputs
from mrfit.io.schemas import discovery as schemas
from mrfit.io.workspace import Workspace, write_text
from mrfit.report import explain
from mrfit.report.curves import prefixed
from mrfit.report.discovery_figures import figures_of, taken_by
from mrfit.report.discovery_source import Discovery, files_of, read_discovery
from mrfit.report.formula_words import formula_sentences
from mrfit.report.key import STYLE_SHEET
from mrfit.report.law_repair_words import law_repair_sentences
from mrfit.report.law_words import law_sentences, nearer_law, other_base_sentences
from mrfit.report.numbers import in_html, percent, significant
from mrfit.report.sections import SECTIONS_TEMPLATE, Section, Table, exact, figures_in_page
from mrfit.report.sections import render as render_sections
from mrfit.simulate.current_dependence import form_of

PARAMETER_HEADS = ("effect", "parameter", "meaning", "value", "95 % interval")


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
    workspace.discovery()
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
    found = workspace.discovery()
    reason = Inputs(workspace).reason(found, discovery_key, "discover") if found.settings else ""
    return Advice(found.base_model, found.verdict, found.ambiguous_set, found.advice, bool(reason), reason)


def _key(workspace: Workspace) -> str:
    inputs = [SECTIONS_TEMPLATE, STYLE_SHEET, *(p for p in files_of(workspace) if p.is_file())]
    hashes = [(p.name, hashlib.sha256(p.read_bytes()).hexdigest()) for p in inputs]
    return key_of("discovery page", hashes, version("matplotlib"), version("jinja2"))


def render(discovery: Discovery, key: str) -> str:
    """Return the page of a discovery; ``key`` is kept in it."""
    found = discovery.found
    figures = figures_in_page(figures_of(discovery), "f")
    both = found.augmented_model != found.base_model or found.held
    sections = [
        *_verdict(found),
        Section("Before and after" if both else "What the base model leaves", figures=figures),
        *_candidates(found),
        *_confusion(found.cosines, found.candidates),
        *_law(found),
        Section("What was run", tables=[Table("What was run", ("item", "value"), _facts(discovery), name="run")]),
        Section("Segments", tables=[_segments(found)], folded=True),
    ]
    files = "discovery.json" + (", every sample's error: residuals.parquet" if figures else "")
    lead = f"Verdict: {found.verdict.replace('-', ' ')}"
    page = render_sections(f"Discovery on {found.base_model}", lead, (), sections, files)
    return page.replace("<title>", f'<meta name="mrfit-key" content="{key}">\n<title>', 1)


def _verdict(found: schemas.DiscoveryFile) -> list[Section]:
    """Return the sections on the conclusion, on what is open with tests that would settle it, and on the law."""
    words = [Markup('<strong class="headline {}">{}</strong>').format(found.verdict, explain.headline(found))]
    if nearer := nearer_law(found):
        text = (
            "<strong>{} is nearer:</strong> it takes {} % of the gap on held-out conditions. "
            "Look from there for what is still missing: <code>{}</code>"
        )
        words.append(Markup(text).format(nearer.model, f"{100.0 * nearer.takes:.0f}", nearer.command))
    words.append(escape(" ".join(explain.sentences(found, law=False))))
    if command := explain.next_step(found):
        text = "The model with what was found is fitted like any other: <code>{}</code>"
        words.append(Markup(text).format(command))
    formula = Section("A formula for what has no name", points=formula_sentences(found))
    repair = Section("A term that the law lacks", points=law_repair_sentences(found))
    return [Section("Verdict", words, [_effects(found)]), _open_questions(found), _law_words(found), repair, formula]


def _effects(found: schemas.DiscoveryFile) -> Table:
    caption = "Effects found, fitted together with the base model"
    if found.held:
        caption = "Effects found whatever the law is; the errors are those of the base, fitted again with them held"
    rows: list[Sequence[object]] = []
    for effect in found.effects:
        errors = [exact(e, percent(e)) for e in (effect.holdout_nrmse_before, effect.holdout_nrmse_after)]
        rows += _parameters(effect.name, explain.parameter_rows(effect), errors)
    return Table(caption, (*PARAMETER_HEADS, "hold-out NRMSE without", "with"), rows, name="effects")


def _open_questions(found: schemas.DiscoveryFile) -> Section:
    """Return the section on effects that these data cannot tell apart, with the tests that would tell."""
    several = [explain.effect_words(name) for name in found.ambiguous_set]
    rows: list[Sequence[object]] = []
    for row in found.suspects:
        name = f"{row.name} instead of {row.instead_of}" if row.instead_of else row.name
        # effects that were taken back would take their share together
        takes = taken_by(found, row.name) if found.ambiguous_set else None
        takes = row.closed if takes is None else takes
        rows += _parameters(
            name, explain.parameter_rows(row), [exact(takes, "" if takes is None else explain.closed_share(takes))]
        )
    each, gap = ("each", "squared error") if several else ("these together", "gap")
    when = "took away when it was last tried" if several else "would take"
    caption = (
        f"What {each} would be, fitted with the base model, and the share of the {gap} on held-out conditions that it "
        f"{when}"
    )
    words = [f"These data cannot tell apart: {'; '.join(several)}."] if several else []
    tables = [Table(caption, (*PARAMETER_HEADS, "takes (%)"), rows, name="suspects")]
    # what is too little is said with the verdict
    told = () if found.verdict == "insufficient-data" and not rows else found.advice
    title = "What would settle it" if several or told else "What takes part of the gap"
    return Section(title, words, tables, points=told)


def _parameters(name: str, rows: Sequence[explain.ParameterText], numbers: Sequence[Markup]) -> list[Sequence[object]]:
    """Return rows of the parameters of an effect, whose name and other numbers stand in the first."""
    blank = [""] * len(numbers)
    return [
        (
            "" if k else name,
            Markup("<code>{}</code>").format(p.name),
            p.text,
            p.value,
            p.interval,
            *(blank if k else numbers),
        )
        for k, p in enumerate(rows)
    ]


def _law_words(found: schemas.DiscoveryFile) -> Section:
    title = "Whatever the law is, and the law itself" if found.held else "What any law could make, and what none does"
    return Section(title, points=[*law_sentences(found), *other_base_sentences(found)])


def _candidates(found: schemas.DiscoveryFile) -> list[Section]:
    if not found.candidates:
        return []
    words = (
        "An effect that was refitted, jointly with everything else, takes the share of the squared error on held-out "
        "conditions that it took away when it was last tried. One that was screened could take that share of the "
        "squared training error, of what no refit of the model's own parameters takes, to first order."
    )
    rows = []
    for row in found.candidates:
        share, shown, judged = explain.takes_of(found, row)
        title, yes = registry.load("effect", row.name).SPEC.title, "yes" if row.accepted else "no"
        rows.append((row.name, title, exact(share, shown), judged, yes, row.reason))
    heads = ("effect", "what it is", "takes (%)", "judged", "accepted", "reason")
    accepted = [k for k, row in enumerate(found.candidates) if row.accepted]
    caption = "Every effect of the library and what became of it"
    return [Section("Candidates", [words], [Table(caption, heads, rows, name="candidates", best=accepted)])]


def _confusion(cosines: schemas.Cosines | None, candidates: Sequence[schemas.Candidate]) -> list[Section]:
    """Return the cosines between what the effects judged do, as a lower triangle, and which were not judged."""
    if not candidates:
        return []
    table = cosines or schemas.Cosines(names=(), matrix=())
    names, matrix, alike = table.names, table.matrix, table.alike
    words, tables, rows = list[str](), list[Table](), []
    for k, name in enumerate(names):
        shown = [_marked(c, alike) for c in matrix[k][:k]]
        rows.append((name, *shown, "1", *[""] * (len(names) - k - 1)))
    if rows:
        words = [
            "The cosine between what two effects do to the output, beyond what the model's own parameters do. Pairs "
            f"above {alike:g}, which are marked, may look like each other: beside one that is named the other has to "
            "take away more of the error to be named too; what is left of the difference decides between them, if the "
            "noise lets it."
        ]
        tables = [Table("Cosines of projected sensitivities", ("effect", *names), rows, name="confusion")]
    alone = [n for k, n in enumerate(names) if all(abs(c) <= alike for j, c in enumerate(matrix[k]) if j != k)]
    words += [f"Told apart from every other: {', '.join(alone)}."] * bool(alone)
    points = [
        Markup("<strong>{}</strong>: {}").format(c.name, c.reason)
        for c in candidates
        if c.reason.startswith(explain.UNJUDGED)
    ]
    return [Section("What these data confuse", words, tables, points=points)]


def _marked(cosine: float, alike: float) -> str:
    """Return a cosine, marked where the discovery took the two effects for alike."""
    shown = in_html(f"{cosine:.3f}")
    return Markup("<mark>{}</mark>").format(shown) if abs(cosine) > alike else shown


def _law(found: schemas.DiscoveryFile) -> list[Section]:
    """Return the effects tested against any law, and other laws."""
    examined, tables, words = found.invariance, list[Table](), list[str]()
    if examined is not None and (effects := (*examined.named, *examined.turned_down)):
        words.append(
            "A law of the fluid, whatever its form, is reversed with the motion, forgets, and does not know where in "
            "the stroke, when and how warm it is. What an effect does beyond all such laws cannot be the law's. Shares "
            "are of the squared error that no law makes; “kept” and “held out” are the same on conditions left out, "
            "with the law from all conditions and from the others."
        )
        heads = ("effect", "breaks", "share (%)", "kept (%)", "held out (%)", "standard errors", "named", "reason")
        rows = [_tested(e, e in examined.named) for e in effects]
        best = range(len(examined.named))
        tables.append(Table("Effects tested against any law", heads, rows, name="tested", best=best))
    if found.other_laws:
        words.append("Other laws, each fitted once; shares are of the base's gap on held-out conditions.")
        law_heads = (
            "model",
            "takes (%)",
            "with the effects held (%)",
            "error in noise floors",
            "what it lacks in turn",
        )
        rows = [
            (o.model, _of_hundred(o.takes), _of_hundred(o.takes_beside), exact(o.floors, significant(o.floors)),
             Markup("<code>{}</code>").format(o.command))
            for o in found.other_laws
        ]  # fmt: skip
        tables.append(Table("Other laws that take part of the gap", law_heads, rows, name="laws"))
    caption = "Effects that cannot be told from the law, and the test that would separate them"
    unclear = [(c.name, c.reason, c.test) for c in found.confounded]
    folded = Table(caption, ("effect", "why", "test"), unclear, name="confounded")
    return [
        Section("Effects and the law", words, tables),
        Section("What the law could imitate on these data", tables=[folded], folded=True),
    ]


def _tested(effect: schemas.InvariantEffect, named: bool) -> Sequence[object]:
    s = effect.standing
    shares = (s.share, s.kept, s.held) if s else (None, None, None)
    errors = exact(s.z, significant(s.z)) if s else ""
    reason = effect.reason or ("one of a set" if effect.one_of else "no law makes what it does")
    return effect.name, effect.breaks, *map(_of_hundred, shares), errors, "yes" if named else "no", reason


def _of_hundred(share: float | None) -> Markup:
    return exact(share, "" if share is None else significant(100.0 * share))


def _segments(found: schemas.DiscoveryFile) -> Table:
    rows = [(s.id, s.condition, "hold-out" if s.role == "holdout" else "training") for s in found.segments or ()]
    return Table("Segments used, by role", ("segment", "condition", "role"), rows, name="used")


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
        ("Errors", "RMS over the output's range in all conditions; a comparison divides by that of held-out ones"),
        ("Seed", str(found.seed)),
        ("Data hash", f"SHA-256 {found.data_sha256[:16]}…" if found.data_sha256 else ""),
        ("Program", f"mrfit {version('mrfit')}"),
    ]
    return [(label, text) for label, text in facts if text]


def _physical(value: float, discovery: Discovery) -> str:
    factor, unit = prefixed(value, discovery.unit)
    return f"{in_html(significant(factor * value))} {unit}".strip()


def _dependence(dependence: schemas.DiscoveryDependence | None) -> str:
    """Return the orders of the base's parameters over current, as in ``fy of order 2, c of order 2, 0 to 2 A``."""
    if not dependence:
        return ""
    varied = ", ".join(f"{name} of order {_order(order)}" for name, order in dependence.orders if order)
    return f"{varied}, {dependence.low:g} to {dependence.high:g} A"


def _order(order: int | str) -> str:
    """Return an order in words, the form it was chosen in behind it: ``2 (log)``."""
    form = form_of(order)
    return f"{str(order).removeprefix(form)} ({form})" if form else str(order)
