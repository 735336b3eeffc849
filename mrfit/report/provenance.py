"""Where the data came from, as rows for the page: recordings and what was odd, flux reconstruction, segments."""

from typing import Any

from mrfit.core.channels import unit_of
from mrfit.report.numbers import MISSING, in_html, natural, significant, unit_html
from mrfit.report.tables import ROLES


def recording_row(about: dict[str, Any]) -> dict[str, Any]:
    """Return one recording of ingest.json with its channels, and sample rate as text."""
    channels = [f"{c['name']} ({unit_html(c['unit']) or '1'})" for c in about.get("channels", [])]
    dt = about.get("dt")
    return {
        **{"findings": [], "history": [], **about},
        "channels": ", ".join(channels),
        "rate": _with_unit(1.0 / dt if dt else None, "Hz", 4),
    }


_DRIFTS = {"cycle": "drift removed cycle by cycle", "linear": "one linear drift removed", "none": "no drift removed"}


def flux_section(flux: dict[str, Any]) -> dict[str, Any]:
    """Return flux.json as rows and sentences: resistance and its source, drift, closure, loop area, oddities, losses.

    Parameters
    ----------
    flux
        Content of flux.json; empty if the stage has not run.
    """
    settings = flux.get("settings", {})
    rule, drift = settings.get("rule", ""), settings.get("drift", "")
    integrated = [r for r in flux.get("recordings", []) if r.get("resistance") is not None]
    others = [r for r in flux.get("recordings", []) if r.get("resistance") is None]
    return {
        "how": f"λ = λ0 + ∫(u − R·i) dt by the {rule} rule, {_DRIFTS.get(drift, drift)}" if rule else "",
        "rows": [_flux_row(r) for r in integrated],
        "others": [f"{r['id']}: {r.get('action', '')}" for r in others],
        "findings": flux.get("findings", []),
        "separation": flux.get("separation_text", []),
    }


def _flux_row(row: dict[str, Any]) -> dict[str, str]:
    error = row.get("resistance_error")
    text = in_html(significant(row["resistance"], 5))
    return {
        "id": row["id"],
        "resistance": f"{text} ± {in_html(significant(error, 2))}" if error else text,
        "source": row.get("resistance_source", ""),
        **{
            name: in_html(significant(row.get(name))) for name in ("lambda0", "offset_volt", "closure_rms", "loop_area")
        },
    }


def segment_rows(segments: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the rows of the table of segments in natural order, quantities with their unit."""
    return [
        {
            **s,
            "role": ROLES.get(s["role"], s["role"]),
            "frequency": _with_unit(s["frequency"] or None, "Hz"),
            "amplitude": _with_unit(s["amplitude"], unit_html(unit_of(s["drive"]))),
            "current": _with_unit(s["current"], "A"),
            "temperature": _with_unit(s["temperature"], "°C"),
            "samples": s["stop"] - s["start"],
        }
        for s in sorted(segments, key=lambda s: natural(s["id"]))
    ]


def _with_unit(value: float | None, unit: str, digits: int = 3) -> str:
    text = significant(value, digits)
    return f"{in_html(text)} {unit}".strip() if text else MISSING
