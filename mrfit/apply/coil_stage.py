"""Results on a coil in a workspace: the current of a flux linkage, and the voltage for a wanted one."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrfit.apply.coil import BOUND, Coil, FluxCommand, FluxCurrent, current_of_flux
from mrfit.apply.figures import MEASURED, PALETTE, SIMULATED, Curve, Panel, figure
from mrfit.apply.motion import check_length, sine_phase, written_sine
from mrfit.apply.page import Columns, table_of, values_of
from mrfit.apply.stage import spans, write
from mrfit.core.recording import Recording
from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.io.columns import part_of
from mrfit.io.schemas.apply import CoilEntry, CurrentFile, CurrentRow, FluxCommandFile
from mrfit.report.sections import Section, SectionFigure, render
from mrfit.settings.apply import CoilDrive

ROUNDING = 1e-11
"""Share below which a difference is that of rounding."""
# Least samples of a known beginning
_FEWEST = 3


@dataclass(frozen=True)
class LoggedFlux:
    """A log's flux linkage and what the model makes of it; ``measured`` is the logged current, None without one."""

    row: CurrentRow
    time: Array
    flux: Array
    found: FluxCurrent
    measured: Array | None


def inverted_log(coil: Coil, recording: Recording, known: float) -> LoggedFlux:
    """Return the current of a log's flux linkage, which is known for so many s from its first sample.

    Raises
    ------
    DataError
        If the log has no flux linkage, is too long, or its current is not there to be known.
    """
    source, channels = Path(recording.source).name or recording.id, recording.channels
    if "flux" not in channels:
        raise DataError(f"{source}: no flux linkage, and no voltage and current from which to reconstruct it")
    check_length(source, recording.samples)
    taken = {n: part_of(c, 0, recording.samples) for n, c in channels.items()}
    count = round(known / recording.dt)
    if count and "current" not in taken:
        raise DataError(f"{source}: no current was logged that --known could take")
    if count and not _FEWEST <= count < recording.samples:
        raise DataError(
            f"{source}: --known {known:g} s is {count} of its {recording.samples} samples; give {_FEWEST} or more, "
            "and fewer than all"
        )
    flux, measured = taken["flux"], taken.get("current")
    beginning = measured[:count] if measured is not None and count else None
    found = current_of_flux(coil, flux, recording.dt, beginning, taken)
    off = None if measured is None else float(np.sqrt(np.mean((found.current - measured)[count:] ** 2)))
    extent = 0.0 if measured is None else float(np.ptp(measured))
    row = CurrentRow(
        log=recording.id,
        samples=recording.samples,
        dt=recording.dt,
        known=count,
        offset=found.offset,
        history=tuple(found.history.tolist()),
        range=float(np.ptp(found.current)),
        rms_error=off,
        error=off / extent if off is not None and extent > 0.0 else None,
    )
    return LoggedFlux(row, _times(recording), flux, found, measured)


def currents(work: Path, coil: Coil, logs: Sequence[LoggedFlux]) -> CurrentFile:
    """Write the currents of flux linkages as Parquet tables, and the page; return the document."""
    rows = [one.row for one in logs]
    columns: Columns[CurrentRow] = {
        "log": lambda r: r.log,
        "samples": lambda r: r.samples,
        "known (s)": lambda r: r.known * r.dt,
        "constant of the flux (Wb)": lambda r: r.offset,
        "range (A)": lambda r: r.range,
        "rms error (A)": lambda r: r.rms_error,
        "over the range (%)": lambda r: None if r.error is None else 100.0 * r.error,
    }
    notes = _left_out(coil)
    table = table_of("Currents found; errors are those behind the known beginning", columns, rows)
    sections = [Section("Summary", notes, [table]), *(_current_section(one, k) for k, one in enumerate(logs))]
    direct = coil.spec.output == "current"
    how = "the model, which gives it directly" if direct else "the flux model inverted along its branch curve"
    lead = f"The current of a flux linkage, by {how}."
    page = render(f"Current of the flux of {coil.name}", lead, _facts(coil), sections, "current.json")
    tables = {
        f"current-{k}.parquet": {
            "time": one.time,
            "flux": one.flux,
            "current": one.found.current,
            "magnetising_current": one.found.magnetising,
            **({} if one.measured is None else {"measured": one.measured}),
        }
        for k, one in enumerate(logs, start=1)
    }
    return write(work, CurrentFile(fit=coil.name, coil=_entry(coil), logs=rows, notes=notes), page, tables)


def flux_command(
    work: Path, coil: Coil, plant: Coil, drive: CoilDrive, wanted: str, found: FluxCommand
) -> FluxCommandFile:
    """Write a wanted flux linkage, its voltage and what comes of it, and the page; return the document."""
    alone = "The plant is the model itself: differences are those of limits and numbers, not the model's errors."
    notes = [
        *([alone] if plant == coil else []),
        f"Greatest difference of flux wanted and flux got: {percent_text(found.error)} of the range wanted, "
        f"rms {percent_text(found.rms_error)}.",
    ]
    greatest = {"V": float(np.max(np.abs(found.voltage))), "A": float(np.max(np.abs(found.commanded_current)))}
    limits = {u: limit for u, limit in (("V", drive.voltage), ("A", drive.current)) if limit is not None}
    binding = [f"{limit:g} {u}" for u, limit in limits.items() if greatest[u] >= BOUND * limit]
    said = " and ".join(f"{limit:g} {u}" for u, limit in limits.items())
    if binding:
        held = " and ".join(binding)
        notes.append(
            f"{held}: at the limit in {100.0 * found.limited:.3g} % of the samples, where the flux stays behind."
        )
    if free := [f"{limit:g} {u}" for u, limit in limits.items() if greatest[u] < BOUND * limit]:
        notes.append(f"{' and '.join(free)}: the limit never binds.")
    notes += _left_out(coil)
    document = FluxCommandFile(
        fit=coil.name,
        coil=_entry(coil),
        plant=_entry(plant),
        resistance=drive.resistance,
        voltage=drive.voltage,
        current=drive.current,
        wanted=wanted,
        samples=len(found.time),
        dt=float(found.time[1]),
        range=float(np.ptp(found.wanted)),
        error=found.error,
        rms_error=found.rms_error,
        limited=found.limited,
        greatest_voltage=float(np.max(np.abs(found.voltage))),
        greatest_current=float(np.max(np.abs(found.current))),
        notes=notes,
    )
    facts = [
        *_facts(coil),
        ("Plant", plant.name + ("" if plant == coil else f": {plant.model}")),
        ("Drive", f"{drive.resistance:g} ohm; limits: {said or 'none'}; voltage held over {document.dt:g} s"),
    ]
    page = render(
        f"Voltage for a flux of {coil.name}",
        "A wanted flux linkage, the voltage for it, u = R*i + d(flux)/dt, and the coil under this voltage.",
        facts,
        [Section(wanted, notes, (), [_command_figure(found)])],
        "flux-command.json",
    )
    names = ("time", "wanted", "voltage", "flux", "current", "predicted")
    return write(work, document, page, {"flux-command.parquet": {n: getattr(found, n) for n in names}})


def wanted_sine(text: str, dt: float) -> tuple[str, Array]:
    """Return the name and the flux linkage in Wb of a sine ``HZ:WB`` or ``HZ:WB:CYCLES``.

    Raises
    ------
    ConfigError
        If it is malformed, or has fewer than 20 samples a cycle.
    """
    frequency, amplitude, cycles = written_sine(text, "WB")
    series = np.asarray(amplitude * np.sin(sine_phase(frequency, cycles, dt)))
    return f"Sine of {frequency:g} Hz and {amplitude:g} Wb", series


def wanted_flux(recordings: Sequence[Recording]) -> tuple[Array, float]:
    """Return the flux linkage in Wb of a file, and its sample interval in s.

    Raises
    ------
    DataError
        If there is not one log with a flux linkage.
    """
    source = Path(recordings[0].source).name if recordings else "the file"
    if len(recordings) != 1 or "flux" not in recordings[0].channels:
        raise DataError(f"{source}: needs a column 'flux' beside the time, in one stretch without gaps")
    one = recordings[0]
    check_length(source, one.samples)
    return np.array(part_of(one.channels["flux"], 0, one.samples)), one.dt


def percent_text(share: float) -> str:
    """Return a share in percent, of rounding as what it is below."""
    return "less than 10⁻⁹ %" if 0.0 < share < ROUNDING else f"{100.0 * share:.3g} %"


def _times(recording: Recording) -> Array:
    return np.float64(recording.start) + np.arange(recording.samples, dtype=np.float64) * np.float64(recording.dt)


def _entry(coil: Coil) -> CoilEntry:
    return CoilEntry(name=coil.name, model=coil.model, parameters=coil.parameters, left_out=coil.left_out)


def _left_out(coil: Coil) -> list[str]:
    return [f"Left out, as effects of instruments: {', '.join(coil.left_out)}."] if coil.left_out else []


def _facts(coil: Coil) -> list[tuple[str, str]]:
    return [
        ("Coil", f"{coil.name}: {coil.model}"),
        ("Equation", coil.spec.equation),
        ("Parameters", values_of(coil.parameters, coil.spec)),
    ]


def _current_section(one: LoggedFlux, k: int) -> Section:
    t, found = one.time, one.found
    logged = [] if one.measured is None else [Curve(t, one.measured, "measured", MEASURED, "-", 2.0)]
    panels = [
        Panel("Flux", "t (s)", "flux (Wb)", [Curve(t, one.flux, "", PALETTE[2])]),
        Panel("Current", "t (s)", "i (A)", [*logged, Curve(t, found.current, "of the flux", SIMULATED)]),
    ]
    known = f"The current is known for the first {found.known * one.row.dt:.4g} s." if found.known else ""
    drawn = SectionFigure("Flux and current.", known, figure(panels, f"c{k}", f"Flux and current, {one.row.log}"))
    return Section(one.row.log, (), (), (drawn,))


def _command_figure(found: FluxCommand) -> SectionFigure:
    t, bound = found.time, found.at_limit
    flux = [Curve(t, found.wanted, "wanted", MEASURED, "-", 2.2), Curve(t, found.flux, "got", SIMULATED)]
    panels = [
        Panel("Flux", "t (s)", "flux (Wb)", flux, marks=spans(t, bound)),
        Panel("Voltage", "t (s)", "u (V)", [Curve(t, found.voltage, "", PALETTE[2])]),
        Panel("Current", "t (s)", "i (A)", [Curve(t, found.current, "", PALETTE[0])]),
    ]
    caption = "Red: voltage or current is at its limit." if bound.any() else ""
    return SectionFigure("Flux, voltage and current.", caption, figure(panels, "f", "Flux, voltage and current"))
