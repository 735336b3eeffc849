"""Provenance of the data, as rows for the page: recordings and their oddities, flux reconstruction, segments."""

from collections.abc import Sequence
from dataclasses import dataclass

from mrfit.core.channels import unit_of
from mrfit.core.recording import Segment
from mrfit.io.schemas.stages import About, FluxFile, FluxRow
from mrfit.report.numbers import MISSING_NUMBER, in_html, natural, significant, unit_html
from mrfit.report.tables import ROLE_WORDS


@dataclass(frozen=True)
class RecordingRow:
    """A recording, with its rate and channels in words."""

    about: About
    rate: str
    channels: str


@dataclass(frozen=True)
class ResistanceRow:
    """A recording whose flux was integrated, quantities in words."""

    id: str
    resistance: str
    source: str
    lambda0: str
    offset_volt: str
    closure_rms: str
    loop_area: str


@dataclass(frozen=True)
class FluxSection:
    """Rows and sentences on the flux: method, recordings, those not integrated, oddities, losses."""

    how: str = ""
    rows: Sequence[ResistanceRow] = ()
    others: Sequence[str] = ()
    findings: Sequence[str] = ()
    separation: Sequence[str] = ()


@dataclass(frozen=True)
class SegmentRow:
    """A segment, with its role and quantities in words."""

    segment: Segment
    role: str
    frequency: str
    amplitude: str
    current: str
    temperature: str


def recording_row(about: About) -> RecordingRow:
    """Return one recording with its channels, and sample rate as text."""
    return RecordingRow(
        about,
        rate=_with_unit(1.0 / about.dt, "Hz", 4),
        channels=", ".join(f"{c.name} ({unit_html(c.unit) or '1'})" for c in about.channels),
    )


_IN_WORDS = ("lambda0", "offset_volt", "closure_rms", "loop_area")
_DRIFTS = {"cycle": "drift removed cycle by cycle", "linear": "one linear drift removed", "none": "no drift removed"}


def flux_section(flux: FluxFile | None) -> FluxSection:
    """Return flux.json as rows and sentences: resistance and its source, drift, closure, loop area, oddities, losses.

    Parameters
    ----------
    flux
        Content of flux.json; None if the stage has not run.
    """
    if flux is None:
        return FluxSection()
    rule, drift = flux.settings.rule, flux.settings.drift
    return FluxSection(
        how=f"λ = λ0 + ∫(u − R·i) dt by the {rule} rule, {_DRIFTS.get(drift, drift)}" if rule else "",
        rows=[_flux_row(r) for r in flux.recordings if r.resistance is not None],
        others=[f"{r.id}: {r.action}" for r in flux.recordings if r.resistance is None],
        findings=flux.findings,
        separation=flux.separation_text,
    )


def _flux_row(row: FluxRow) -> ResistanceRow:
    error = row.resistance_error
    text = in_html(significant(row.resistance, 5))
    return ResistanceRow(
        id=row.id,
        resistance=f"{text} ± {in_html(significant(error, 2))}" if error else text,
        source=row.resistance_source,
        **{name: in_html(significant(getattr(row, name))) for name in _IN_WORDS},
    )


def segment_rows(segments: Sequence[Segment]) -> list[SegmentRow]:
    """Return the rows of the table of segments in natural order, quantities with their unit."""
    return [
        SegmentRow(
            s,
            role=ROLE_WORDS.get(s.role, s.role),
            frequency=_with_unit(s.frequency or None, "Hz"),
            amplitude=_with_unit(s.amplitude, unit_html(unit_of(s.drive))),
            current=_with_unit(s.current, "A"),
            temperature=_with_unit(s.temperature, "°C"),
        )
        for s in sorted(segments, key=lambda s: natural(s.id))
    ]


def _with_unit(value: float | None, unit: str, digits: int = 3) -> str:
    text = significant(value, digits)
    return f"{in_html(text)} {unit}".strip() if text else MISSING_NUMBER
