"""C99: one header, one source, a self-test; no heap, no recursion, ``<math.h>`` only."""

import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mrfit.core.channels import EXCITATIONS, MOTION_OF_MASS, unit_of
from mrfit.core.specs import Array
from mrfit.driven.motion import split
from mrfit.errors import DataError
from mrfit.export.c_parts import Parts, checkable, law_of, parts_of, prefix_of, stated
from mrfit.export.causality import Cost, costs
from mrfit.export.compiler import CompiledModel, compiled, compiler
from mrfit.export.head import CAUSALITY, head_lines
from mrfit.export.motion import motion_of
from mrfit.export.printer import ir
from mrfit.export.printer.c_text import constants, function_text, macros, math_functions, small_functions
from mrfit.export.source import ExportSource
from mrfit.export.stage import Files
from mrfit.export.templating import TEMPLATES, environment
from mrfit.export.text import LONGEST_SYMBOL, c_comment, field, identifier, number
from mrfit.export.tracker import TrackerPlan, plan_of
from mrfit.settings.export import Settings

# What the names of a tracker end with
TRACKER_ENDING = "_tracker"
MACRO = re.compile(r"@(?=[A-Z])")
# Samples of the self-test
_TESTED = 500
# Share of the output's range by which the exported model may differ from the simulation in Python
EXACT, EXACT_FLOAT = 1e-9, 1e-2
# The same of a driven mass, whose excitation is a cubic through the last samples and no windowed sinc
CUBIC_DRIVE = 3e-2


@dataclass(frozen=True)
class Difference:
    """Difference of an export from the simulation in Python, over the fit's logs.

    Attributes
    ----------
    largest, rms
        Error as a share of the output's range; None if it could not be measured.
    samples, segments
        What it was measured on.
    uneven
        Largest error at uneven steps, likewise; None if it was not measured.
    why_not
        Why it was not measured.
    """

    largest: float | None = None
    rms: float | None = None
    samples: int = 0
    segments: int = 0
    uneven: float | None = None
    why_not: str = ""

    @property
    def text(self) -> str:
        """It in words."""
        if self.largest is None or self.rms is None:
            return f"Difference from the simulation in Python: not measured ({self.why_not})."
        steps = (
            f" At uneven steps, on two in three of them: {self.uneven:.2g} at most." if self.uneven is not None else ""
        )
        return (
            f"Difference from the simulation in Python on {self.samples} samples of {self.segments} segments of the "
            f"logs: {self.largest:.2g} of the output's range at most, {self.rms:.2g} RMS.{steps}"
        )


@dataclass(frozen=True)
class SelfTest:
    """Context of the self-test's template.

    Attributes
    ----------
    rows, columns
        Inputs and output of every sample, and what they are.
    dt
        Sample interval in s.
    range
        Extent of the output, of which ``tolerance`` is the share that an error may have, ``float_tolerance`` in float.
    """

    rows: list[list[str]]
    columns: list[str]
    dt: str
    range: str
    tolerance: str
    float_tolerance: str


@dataclass(frozen=True)
class CExport:
    """The files' contents by name, what was measured, and what is to be told."""

    prefix: str
    files: dict[str, str]
    difference: Difference
    cost: Cost
    notes: tuple[str, ...]


def c_export(source: ExportSource) -> CExport:
    """Return the C99 form of a fit, compared with the simulation where there is a compiler.

    Raises
    ------
    DataError
        If the model or an effect has no C form.
    """
    parts = parts_of(source)
    cost = costs(source)
    draft = rendered(source, parts, ["not measured yet"], cost)
    difference = differs(source, parts, draft)
    told = [difference.text, *notes_of(source), "", *causality_told(source, cost)]
    files = rendered(source, parts, told, cost)
    return CExport(parts.context.p, files, difference, cost, tuple(notes_of(source)))


def files(source: ExportSource, settings: Settings) -> Files:
    """Return header, source and self-test, and header and source of a tracker."""
    made = c_export(source)
    own = tracker_files(source, plan_of(source, settings.track), made.cost) if settings.track else {}
    contents = {name: text.encode("ascii") for name, text in {**made.files, **own}.items()}
    return Files(contents, (made.difference.text, *made.notes, *made.cost.lines), made.difference.largest)


def tracker_files(source: ExportSource, plan: TrackerPlan, cost: Cost) -> dict[str, str]:
    """Return header and source of a model whose parameters are tracked; its names end with ``_tracker``."""
    parts = parts_of(tracker_source(source), plan=plan)
    made = rendered(source, parts, [noise_told(source, plan)], cost)
    return {name: text for name, text in made.items() if not name.endswith("_selftest.c")}


def tracker_source(source: ExportSource) -> ExportSource:
    """Return it with the names of a tracker, whose ending a long name keeps."""
    name = identifier(prefix_of(source.prefix or source.name), LONGEST_SYMBOL - len(TRACKER_ENDING))
    return replace(source, prefix=f"{name}{TRACKER_ENDING}")


def noise_told(source: ExportSource, plan: TrackerPlan) -> str:
    """Return a sentence on the filters of a tracker, and on its noise."""
    return (
        "Parameters that are tracked are estimated by Kalman filters on the output's error, of which one is chosen. "
        f"Noise of the output: {plan.deviation:.4g} {unit_of(source.spec.output)}, correlated over "
        f"{plan.correlated:.3g} s, as the fit's residual."
    )


def notes_of(source: ExportSource) -> list[str]:
    """Return remarks on times that a causal model cannot have, and on forms that are not the simulation."""
    notes = [
        f"{source.spec.names[k]} is {source.theta[k]:.3g} s: the logs have it before it happens, which a causal "
        "model cannot; it is taken as 0"
        for k in _early(source)
    ]
    return notes + stated(source)


def causality_told(source: ExportSource, cost: Cost) -> list[str]:
    """Return the remarks on smoothed inputs; none of a driven mass."""
    return [] if source.is_driven else [CAUSALITY, *cost.lines]


def _early(source: ExportSource) -> list[int]:
    """Return the places of times by which something happens before its cause."""
    first = len(source.base_theta)
    return [
        k
        for k, p in enumerate(source.spec.params)
        if k >= first and p.unit == "s" and p.low < 0.0 and source.theta[k] < 0.0
    ]


def causal(source: ExportSource) -> ExportSource:
    """Return it with those times 0."""
    theta = source.theta.copy()
    theta[_early(source)] = 0.0
    return replace(source, theta=theta)


def rendered(source: ExportSource, parts: Parts, told: Sequence[str], cost: Cost) -> dict[str, str]:
    """Return the contents of header, source and self-test, by file name."""
    if parts.law:
        return _around(source, parts, told)
    program = parts.program
    motion = motion_of(source, cost.tau)
    logs = parts.context.tunable and any(q.log for q in parts.context.base)
    code = "\n\n".join(
        filter(None, [small_functions(program), constants(program), *map(function_text, program.functions.values())])
    )
    context = {
        **vars(parts.context),
        "motion": motion,
        "code": code,
        "tiny": "@TINY" in code,
        "tracker": parts.tracker,
        **called(program),
        "functions": macros(
            {*math_functions(program), *(("exp", "expm1") if motion else ()), *(("log",) if logs else ())}
        ),
    }
    return _filled_files(source, told, ("header.h.j2", "source.c.j2"), context)


def _filled_files(
    source: ExportSource, told: Sequence[str], templates: tuple[str, str], context: Mapping[str, Any]
) -> dict[str, str]:
    """Return the contents of header and source, of two templates, and of the self-test, by file name."""
    prefix = context["p"]
    short = c_comment([f"{source.assembly.name}: see {prefix}.h"])
    files = {
        f"{prefix}.h": filled(templates[0], context, c_comment(head_lines(source, told))),
        f"{prefix}.c": filled(templates[1], context, short),
    }
    if test := _selftest(source):
        files[f"{prefix}_selftest.c"] = filled("selftest.c.j2", {**context, **vars(test)}, short)
    return files


def _around(source: ExportSource, parts: Parts, told: Sequence[str]) -> dict[str, str]:
    """Return the same of a driven mass: its law, and an integrator around it, in one header and one source."""
    assert parts.law is not None
    law, own = parts.law.p, law_of(source)
    files = rendered(own, replace(parts, context=parts.law, law=None), [], costs(source))
    _, drive, _ = split(source.assembly.name)
    context = {
        **vars(parts.context),
        "law": parts.law,
        "law_header": files[f"{law}.h"],
        "law_source": files[f"{law}.c"].replace(f'#include "{law}.h"\n', ""),
        "drive": field(EXCITATIONS[drive]),
        "by_base": drive == "base",
        "motions": dict(zip(map(field, MOTION_OF_MASS), ("x", "v", "a"), strict=False)),
        "mass": number(float(source.theta[-1])),
    }
    return _filled_files(source, told, ("mass.h.j2", "mass.c.j2"), context)


def called(program: ir.Program) -> dict[str, list[str]]:
    """Return the arguments of functions that templates call, by name."""
    return {n: [a.name for a in program.functions[n].arguments] for n in ("driven", "within")}


def _selftest(source: ExportSource) -> SelfTest | None:
    """Return the self-test: the first samples of a segment in which the output moves most; None without logs."""
    if not source.stretches:
        return None
    stretch = max(checkable(source), key=lambda s: float(np.ptp(s.simulated[:_TESTED])))
    whole = source.drive(stretch)
    drive, expected = whole[:, :_TESTED], causal(source).simulate(whole, stretch.dt)[:_TESTED]
    inputs = [drive[source.spec.inputs.index(n)] for n in source.channels]
    rows = [[number(v) for v in row] for row in np.column_stack([*inputs, expected]).tolist()]
    units = [f"{field(n)} {unit_of(n)}" for n in (*source.channels, source.spec.output)]
    return SelfTest(
        rows=rows,
        columns=units,
        dt=number(stretch.dt),
        range=number(source.output_range),
        tolerance=number(CUBIC_DRIVE if source.is_driven else EXACT),
        float_tolerance=number(CUBIC_DRIVE if source.is_driven else EXACT_FLOAT),
    )


def filled(template: str, context: Mapping[str, Any], head: str = "") -> str:
    """Return a file of a template: the export's prefix for every ``@``, no more than one empty line in a row.

    Names of macros, in capitals, have the prefix in capitals.
    """
    text = environment(TEMPLATES / "c").get_template(template).render(context, head="")
    prefix = f"{context['p']}_"
    text = MACRO.sub(prefix.upper(), text).replace("@", prefix)
    found = [head] if head else []
    for line in map(str.rstrip, text.lstrip("\n").split("\n")):
        if line or found and found[-1] and not found[-1].endswith("{"):
            found.append(line)
    return "\n".join(found)


def driver(parts: Parts) -> str:
    """Return a program that runs the export on rows of numbers, see ``compiler.Compiled``."""
    return filled("tracker_driver.c.j2" if parts.tracker else "driver.c.j2", vars(parts.context))


def built(parts: Parts, files: dict[str, str], options: Sequence[str] = ()) -> AbstractContextManager[CompiledModel]:
    """Give the exported model as a program.

    Raises
    ------
    ConfigError
        If there is no C compiler.
    """
    prefix = parts.context.p
    sources = {n: t for n, t in files.items() if n in (f"{prefix}.h", f"{prefix}.c")}
    answers = 2 + 2 * len(parts.tracker.parameters) if parts.tracker else 2
    return compiled({**sources, "driver.c": driver(parts)}, answers, options)


def differs(source: ExportSource, parts: Parts, files: dict[str, str]) -> Difference:
    """Return the difference of the compiled export from the simulation in Python on the fit's logs."""
    if not source.stretches:
        return Difference(why_not="the fit's logs are not at hand")
    if compiler() is None:
        return Difference(why_not="no C compiler here")
    with built(parts, files, ("-O2",)) as program:
        found = compared(source, lambda drive, dt: program.run(user_inputs(source, drive), dt)[0])
        return found if source.is_driven else replace(found, uneven=_unevenly(source, program))


def _unevenly(source: ExportSource, program: CompiledModel) -> float | None:
    """Return the largest difference, as a share of the output's range, where samples of the logs are missing."""
    rng, largest, low, high = np.random.default_rng(0), 0.0, np.inf, -np.inf
    for drive, dt in source.compared():
        kept = np.flatnonzero(rng.random(drive.shape[1]) < 2.0 / 3.0)
        if len(kept) < 2:
            continue
        steps = dt * np.diff(kept, prepend=kept[0] - 1)
        try:
            wanted = source.simulate(drive[:, kept], steps)
        except DataError:  # a part of a plug-in, which knows equal steps alone
            return None
        off = np.abs(program.run(user_inputs(source, drive[:, kept]), steps)[0] - wanted)
        largest, low, high = max(largest, float(off.max())), min(low, wanted.min()), max(high, wanted.max())
    return largest / (float(high - low) or 1.0)


def user_inputs(source: ExportSource, drive: Array) -> Array:
    """Return the rows of a drive that a user sets."""
    return drive[[source.spec.inputs.index(n) for n in source.channels]]


def compared(source: ExportSource, run: Callable[[Array, float], Array], most: int | None = None) -> Difference:
    """Return the difference of ``run(drive, dt)`` from the simulation in Python on the fit's logs.

    No more than ``most`` samples of each are run; the simulation is that of all samples that are compared, whose middle
    it may take.
    """
    largest, squares, samples, low, high = 0.0, 0.0, 0, np.inf, -np.inf
    drives = source.compared()
    for drive, dt in drives:
        wanted = source.simulate(drive, dt)[:most]
        off = np.abs(run(drive[:, :most], dt) - wanted)
        largest, squares = max(largest, float(np.max(off))), squares + float(np.sum(off**2))
        samples, low, high = samples + len(off), min(low, float(wanted.min())), max(high, float(wanted.max()))
    extent = (high - low) or 1.0
    return Difference(largest / extent, float(np.sqrt(squares / samples)) / extent, samples, len(drives))
