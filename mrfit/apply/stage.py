"""Results of the commands of ``mrfit apply`` in a workspace: ``apply/``, a page and the numbers behind it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from mrfit.apply.car import WITH_DESIRED_DAMPING
from mrfit.apply.figures import MEASURED, PALETTE, SIMULATED, Curve, Panel, figure
from mrfit.apply.inverse import FLAGS
from mrfit.apply.laws import law_words
from mrfit.apply.motion import Motion
from mrfit.apply.page import Columns, facts_of, table_of
from mrfit.apply.ride import QuarterCar
from mrfit.apply.roads import RandomRoad
from mrfit.apply.series import Inversion
from mrfit.apply.solving import REACHED
from mrfit.apply.tested import NamedMotion, beyond_tests
from mrfit.apply.tracking import TrackingCase, TrackingStudy
from mrfit.core.specs import Array
from mrfit.io.schemas import apply as schemas
from mrfit.io.tables import write_table
from mrfit.io.workspace import Workspace, checked, write_json, write_text
from mrfit.report.sections import Section, SectionFigure, Table, render
from mrfit.signal.runs import runs

File = TypeVar(
    "File", schemas.InvertFile, schemas.TrackFile, schemas.QuarterCarFile, schemas.CurrentFile, schemas.FluxCommandFile
)
# What files are called, by schema
_NAMES = {
    schemas.INVERT: "invert",
    schemas.TRACK: "track",
    schemas.QUARTER_CAR: "quarter-car",
    schemas.FLUX_CURRENT: "current",
    schemas.FLUX_COMMAND: "flux-command",
}
_COURSES = (("Sprung acceleration", "a (m/s²)", "acceleration"), ("Damper force", "F (N)", "force"))


def write(work: Path, document: File, page: str, tables: Mapping[str, Mapping[str, Array]] | None = None) -> File:
    """Write a page, its JSON file, and tables as Parquet files; return the document with where they are."""
    workspace, name = Workspace(work), _NAMES[document.schema]
    folder = workspace.root / "apply"
    document = checked(document)
    with workspace.locked():
        write_json(folder / f"{name}.json", document)
        write_text(folder / f"{name}.html", page)
        for file, columns in (tables or {}).items():
            write_table(folder / file, columns)
    return replace(document, page=str(folder / f"{name}.html"), file=str(folder / f"{name}.json"))


def invert(work: Path, found: Sequence[tuple[Motion, Inversion]], desired: str = "as measured") -> schemas.InvertFile:
    """Write the currents of forces, ``desired`` in words, as Parquet tables, and the page; return the document."""
    rows = [replace(one.summary, motion=motion.name) for motion, one in found]
    first = found[0][1]
    notes = notes_of(first)
    x, v, _ = first.damper.motion
    notes += beyond_tests(first.damper, [NamedMotion(m.name, m.channels[x], m.channels[v]) for m, _ in found])
    out = float(np.mean(np.concatenate([one.flag != REACHED for _, one in found])))
    if out > 0.0:
        notes.append(
            f"Out of reach in {100.0 * out:.3g} % of the samples: no current gives the force there at this motion; it "
            "is answered by the nearest."
        )
    sections = [_inversion_section(motion, one, k) for k, (motion, one) in enumerate(found)]
    sections.insert(0, Section("Summary", notes, [_shares(rows, first.damper.output)]))
    lead = "The current for a desired force, sample by sample, with the state of damper and coil carried along."
    facts = [("Desired force", desired), *facts_of(first.damper)]
    page = render(f"Inverse of {first.damper.name}", lead, facts, sections, "invert.json")
    tables = {
        f"invert-{k}.parquet": {str(n): np.asarray(c, dtype=np.float64) for n, c in one.to_frame().items()}
        for k, (_, one) in enumerate(found, start=1)
    }
    return write(work, schemas.InvertFile(fit=first.damper.name, motions=rows, notes=notes), page, tables)


def lag_column(there: bool) -> dict[str, Callable[[Any], Any]]:
    """Return a table's column on the current's lag, none where the damper has no lag."""
    return {"lag": lambda row: "yes" if row.lag else "0"} if there else {}


def notes_of(one: Inversion) -> list[str]:
    """Return remarks on the method that found currents."""
    notes = [
        "Currents were found in closed form: the force is a polynomial of current."
        if one.explicit
        else "Currents were found by Newton's method within bisection; of several that give a force, the least."
    ]
    if one.dead_time > 0.0:
        early = round(one.dead_time / one.dt) * one.dt
        sent = f"Commands are sent {1e3 * early:.3g} ms early, in whole samples"
        sent = sent if early > 0.0 else "No command is sent early, since that is less than half a sample"
        notes.append(f"The field answers {1e3 * one.dead_time:.3g} ms late. {sent}; the rest is in the errors.")
    if one.behind:
        notes.append(
            f"{', '.join(one.behind)}: inverted with the desired force known ahead, and in the errors. On line, where "
            "it is not, this lag stays as an error."
        )
    return notes


def _shares(motions: Sequence[schemas.InversionRow], output: str) -> Table:
    unit = "N" if output == "force" else "N·m"
    columns: Columns[schemas.InversionRow] = {
        "motion": lambda row: row.motion,
        "samples": lambda row: row.samples,
        **{f"{n} (%)": partial(_share, n) for n in FLAGS.values()},
        "limited (%)": lambda row: 100.0 * row.limited,
        f"greatest error where reached ({unit})": lambda row: row.greatest_error_where_reached,
        f"rms error ({unit})": lambda row: row.rms_error,
    }
    return table_of("Desired forces: reached, saturated, or held back by coil and amplifier", columns, motions)


def _share(flag: str, row: schemas.InversionRow) -> float:
    return 100.0 * row.shares[flag]


def _inversion_section(motion: Motion, one: Inversion, k: int) -> Section:
    unit = "N" if one.damper.output == "force" else "N·m"
    t, out = one.time, one.flag != REACHED
    panels = [
        Panel(
            "Force",
            "t (s)",
            f"F ({unit})",
            [Curve(t, one.desired, "desired", MEASURED, "-", 2.0), Curve(t, one.force, "given", SIMULATED)],
            (t, one.low, one.high, "what some current gives"),
            spans(t, out),
        ),
        Panel(
            "Current",
            "t (s)",
            "i (A)",
            [Curve(t, one.current, "command", PALETTE[2]), Curve(t, one.field, "seen by the fluid", PALETTE[0], "--")],
        ),
    ]
    red = " Red: the desired force is outside." if out.any() else ""
    caption = f"Band: forces that some current gives at this motion.{red}"
    drawn = SectionFigure("Force and current.", caption, figure(panels, f"i{k}", f"Force and current, {motion.name}"))
    return Section(motion.name, (), (), (drawn,))


def spans(t: np.ndarray[Any, Any], where: np.ndarray[Any, Any], most: int = 200) -> list[tuple[float, float]]:
    """Return the stretches of time in which something holds, the first ``most`` of them."""
    step = float(t[1] - t[0]) if len(t) > 1 else 0.0
    return [(float(t[a]) - step / 2, float(t[b - 1]) + step / 2) for a, b in runs(where)[:most]]


def quarter_car(work: Path, study: QuarterCar) -> schemas.QuarterCarFile:
    """Write the page of a quarter car, and its numbers; return the document."""
    car, timing = study.car, study.timing
    rigid = "rigid wheel" if not car.unsprung else f"unsprung {car.unsprung:g} kg, tyre {car.tyre:g} N/m"
    desired = [f"{c.name} {c.damping:g}" for c in study.controls if c.name in WITH_DESIRED_DAMPING]
    seeds = ", ".join(f"{r.name}: {r.speed:g} m/s, seed {r.seed}" for r in study.roads if isinstance(r, RandomRoad))
    facts = [
        *facts_of(study.damper),
        ("Car", f"sprung {car.sprung:g} kg, spring {car.spring:g} N/m, {rigid}"),
        *([("Desired damping", f"{', '.join(desired)} N·s/m")] if desired else []),
        ("Sampling", f"every {1e3 * timing.sample:g} ms, simulated by {timing.steps} Runge-Kutta steps in each"),
        *([("Random roads", seeds)] if seeds else []),
    ]
    sections = [
        Section("What was found", study.findings or ["No control chatters."], [_chatters(study)]),
        *(_road_section(study, road.name, k) for k, road in enumerate(study.roads)),
    ]
    if study.checks:
        heads = ("control", "fixed steps (m/s²)", "adaptive (m/s²)", "evaluations of the force", "came to (s)")
        fixed = {r.control: r.acceleration for r in reversed(study.rows) if r.road == study.roads[0].name and r.lag}
        rows = [(n, fixed[n], c.acceleration, c.evaluations, c.ended) for n, c in study.checks]
        table = Table(
            f"Rms of the sprung acceleration on {study.roads[0].name}, by fixed and by adaptive steps", heads, rows, 4
        )
        sections.append(Section("Fixed and adaptive steps", (), [table]))
    lead = "Sprung and unsprung mass on tyre and identified damper, under every control on every road."
    page = render(f"Quarter car on {study.damper.name}", lead, facts, sections, "quarter-car.json")
    return write(work, study.document, page)


def _chatters(study: QuarterCar) -> Table:
    columns: Columns[schemas.RideRow] = {
        "road": lambda r: r.road,
        "control": lambda r: r.control,
        **lag_column(study.lags),
        "chatter (% of time)": lambda r: 100.0 * r.chatter.share if r.chatter.found else 0.0,
        "rate (Hz)": lambda r: r.chatter.rate if r.chatter.found else None,
        "swing (N)": lambda r: r.chatter.swing if r.chatter.found else None,
        "switches (1/s)": lambda r: r.chatter.switching,
        "jumps (1/s)": lambda r: r.chatter.jumps,
        "limit cycle (Hz)": lambda r: r.chatter.limit_cycle or None,
        "cause": lambda r: r.chatter.cause or "–",
        "swing × share of time (N): as is, then without each cause": lambda r: (
            ", ".join(f"{text.removeprefix('without ')} {n:.3g}" for text, n in r.chatter.evidence) or "–"
        ),
    }
    odd = [r for r in study.rows if r.chatter.found or r.chatter.limit_cycle or r.chatter.jumps]
    return table_of("Chatter, switching, jumps and limit cycles; rides without any of them are left out", columns, odd)


def _road_section(study: QuarterCar, road: str, k: int) -> Section:
    columns: Columns[schemas.RideRow] = {
        "control": lambda r: r.control,
        **lag_column(study.lags),
        "rms acceleration (m/s²)": lambda r: r.acceleration,
        "rms tyre load (share of static)": lambda r: r.tyre_load,
        "least tyre load": lambda r: r.least_load,
        "rms travel (mm)": lambda r: 1e3 * r.travel,
        "greatest travel (mm)": lambda r: 1e3 * r.greatest_travel,
        "mean current (A)": lambda r: r.current,
    }
    table = table_of("Comfort, road holding and travel", columns, [r for r in study.rows if r.road == road])
    rides = [r for r in study.rides if r.road.name == road]
    end = min(rides[0].time[-1], 3.0)
    panels = [
        Panel(
            title,
            "t (s)",
            label,
            [
                Curve(r.time[r.time <= end], getattr(r, name)[r.time <= end], r.control.name, PALETTE[n], width=0.9)
                for n, r in enumerate(rides)
            ],
        )
        for title, label, name in _COURSES
    ]
    drawn = SectionFigure(
        "Acceleration and force.",
        f"The first {end:g} s on {road}.",
        figure(panels, f"q{k}", f"Acceleration and force on {road}"),
    )
    return Section(road, (), [table], [drawn])


def track(work: Path, study: TrackingStudy) -> schemas.TrackFile:
    """Write the page of forces tracked, and its numbers; return the document."""
    damper, unit = study.damper, "N" if study.damper.output == "force" else "N·m"
    proportional, integral = study.gains
    facts = [
        *facts_of(damper),
        ("Plant", study.plant.name + ("" if study.plant == damper else f": {study.plant.model}")),
        ("Laws", law_words(damper.output)),
        ("Feedback", f"proportional {proportional:.3g} A/{unit}, integral {integral:.3g} A/({unit}·s), on the error"),
        ("Command", f"at most {study.amplifier.most:g} times the greatest current tested, {damper.high:.4g} A"),
    ]
    sections = [
        Section("Errors", (*study.notes, *ERRORS), [_tracked(study), _regions(study)]),
        *([Section("What the lag costs", (), [_lag_costs(study)])] if study.lag_costs else []),
        *_tracking_sections(study, unit),
    ]
    lead = "Desired forces, and what the damper gives of them under the current that its model asks for."
    page = render(f"Forces tracked by {damper.name}", lead, facts, sections, "track.json")
    return write(work, study.document, page)


ERRORS = (
    "Errors are those against the feasible force: the desired one within what the damper can give at that motion, "
    "which never pushes (inverse-tanh paper eq. 10). Err_rms_f is the rms error over the greatest force (eq. 12), "
    "Err_energy the share by which the energy absorbed differs (eq. 13).",
    "Region I: the wanted current rests at its least or greatest. Region II: it varies. Region III: from a step "
    "between both until the force has come within 5 %. Their squared errors add up to that of the whole.",
)


def _tracked(study: TrackingStudy) -> Table:
    columns: Columns[TrackingCase] = {
        **_which(study),
        "rms error / rms force": lambda c: c.error,
        "the same against the desired force": lambda c: c.error_to_desired,
        "Err_rms_f": lambda c: c.err_peak,
        "Err_energy": lambda c: c.err_energy,
        "greatest command (A)": lambda c: float(c.command.max()),
    }
    return table_of("Errors of every law by every scheme", columns, study.cases)


def _which(study: TrackingStudy) -> Columns[TrackingCase]:
    """Return the columns that tell cases apart."""
    own: Columns[TrackingCase] = {"law": lambda c: c.law, "motion": lambda c: c.motion, "scheme": lambda c: c.scheme}
    return {**own, **lag_column(bool(study.lag_costs))}


def _regions(study: TrackingStudy) -> Table:
    columns = _which(study)
    for k, n in enumerate(("I", "II", "III")):
        columns |= {f"region {n}": partial(_region_error, k), f"share of {n} (%)": partial(_region_share, k)}
    lagging = [c for c in study.cases if c.lag]
    return table_of("Rms error over the rms force by region of the wanted current", columns, lagging)


def _region_error(k: int, case: TrackingCase) -> float | None:
    return case.regions[k].error


def _region_share(k: int, case: TrackingCase) -> float:
    return 100.0 * case.regions[k].share


def _lag_costs(study: TrackingStudy) -> Table:
    heads = ("law", "motion", "scheme", "error", "the same without lag")
    rows = [(r.law, r.motion, r.scheme, r.error, r.without_lag) for r in study.lag_costs]
    return Table("Rms error over the rms force, with the current's lag and with lag 0", heads, rows)


def _tracking_sections(study: TrackingStudy, unit: str) -> list[Section]:
    sections, keys = [], dict.fromkeys((c.motion, c.law) for c in study.cases)
    for k, (motion, law) in enumerate(keys):
        cases = [c for c in study.cases if (c.motion, c.law, c.lag) == (motion, law, study.cases[0].lag)]
        one = cases[0]
        last = one.time >= one.time[-1] - min(one.time[-1], 2.0)
        t = one.time[last]
        forces = [
            Curve(t, one.desired[last], "desired", MEASURED, "--"),
            Curve(t, one.feasible[last], "feasible", MEASURED, width=2.2),
        ]
        forces += [Curve(t, c.force[last], c.scheme, PALETTE[n]) for n, c in enumerate(cases)]
        currents = [Curve(t, one.wanted[last], "wanted", MEASURED, width=2.0)]
        currents += [Curve(t, c.command[last], c.scheme, PALETTE[n]) for n, c in enumerate(cases)]
        stepping = spans(t, one.region[last] == 3.0)
        panels = [
            Panel("Force", "t (s)", f"F ({unit})", forces, marks=stepping),
            Panel("Current", "t (s)", "i (A)", currents, marks=stepping),
        ]
        drawn = SectionFigure(
            "Force and current.",
            f"The last {t[-1] - t[0]:.3g} s; curves of the same course cover each other."
            + (" Red: region III of the first scheme." if stepping else ""),
            figure(panels, f"t{k}", f"{law} on {motion}"),
        )
        sections.append(Section(f"{law}, {motion}", (), (), [drawn]))
    return sections
