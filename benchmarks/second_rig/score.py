"""What a discovery said of a specimen, beside the truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

OUTCOMES = ("right", "open", "wrong", "null-called", "failed")


def score(truth: Mapping[str, object], said: Mapping[str, object]) -> str:
    """Return the outcome of a case.

    ``right``: all that is hidden was named and nothing else, or the verdict is one that is right of these data.
    ``wrong``: a name that is not true of the specimen. ``open``: no false name, and not all was named.
    ``null-called``: nothing is hidden, and something was named or said to be missing.
    """
    verdict = said["verdict"]
    accepted: Sequence[Sequence[str]] = truth["accepted"]  # type: ignore[assignment]
    harmless = set(truth["harmless"])  # type: ignore[call-overload]
    names = set(said["names"]) - harmless  # type: ignore[call-overload]
    if not names and verdict in truth["accepted_verdicts"]:  # type: ignore[operator]
        return "right"
    if not accepted:
        if verdict == "named" and not names:
            return "right"
        return "open" if verdict == "insufficient-data" else "null-called"
    if any(names == set(answer) for answer in accepted):
        return "right"
    return "open" if any(names <= set(answer) for answer in accepted) else "wrong"


def read_discovery(content: Mapping[str, object]) -> dict[str, object]:
    """Take from ``discovery.json`` what is scored and shown."""
    gap: Mapping[str, float | None] = content.get("gap") or {}  # type: ignore[assignment]
    effects: Sequence[Mapping[str, object]] = content.get("effects", [])  # type: ignore[assignment]
    return {
        "verdict": content["verdict"],
        "names": [e["name"] for e in effects],
        "ambiguous": content.get("ambiguous_set", []),
        "floor": gap.get("noise_floor"),
        "before": gap.get("before"),
        "after": gap.get("after"),
        "closed": gap.get("closed"),
        "advice": content.get("advice", []),
        "left_out": content.get("left_out", []),
        "values": {
            f"{e['name']}.{p['name']}": p["value"]
            for e in effects
            for p in e["parameters"]  # type: ignore[attr-defined]
        },
    }


def table(rows: Sequence[Mapping[str, object]], kinds: Sequence[str]) -> str:
    """Return a table by kind, in Markdown."""
    head = ["kind", "cases", *OUTCOMES, "right (%)", "processor time: median, greatest (s)"]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for kind in [*kinds, "all"]:
        chosen = [r for r in rows if kind in (r["kind"], "all")]
        if not chosen:
            continue
        counts = [sum(r["outcome"] == o for r in chosen) for o in OUTCOMES]
        times = sorted(float(r["processor_time"]) for r in chosen)  # type: ignore[arg-type]
        share = f"{100 * counts[0] / len(chosen):.0f}"
        cells = [kind, len(chosen), *counts, share, f"{times[len(times) // 2]:.0f}, {times[-1]:.0f}"]
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    return "\n".join(lines)


def describe(row: Mapping[str, object], keep: Path | None) -> str:
    """Return one line on a case that is not right: what is hidden, and what was said."""
    hidden: Mapping[str, Mapping[str, float]] = row["hidden"]  # type: ignore[assignment]
    parts = [f"{name} {size['contrast']:.1f}x" for name, size in hidden.items()]

    def number(key: str) -> str:
        return "-" if row.get(key) is None else f"{float(row[key]):.4g}"  # type: ignore[arg-type]

    said = f"{row.get('verdict')} {'+'.join(row.get('names', []))}".strip()  # type: ignore[arg-type]
    if row.get("ambiguous"):
        said += f" of {row['ambiguous']}"
    gap = f"before {number('before')}, after {number('after')}, floor {number('floor')}, closed {number('closed')}"
    where = f"; {keep / str(row['case'])}" if keep else ""
    base = f"{row['base']}, {row['waves']}, {row['commands']}, fault {row['fault']}"
    return f"- `{row['case']}` {row['outcome']} ({base}; hidden {', '.join(parts) or 'nothing'}): {said}; {gap}{where}"
