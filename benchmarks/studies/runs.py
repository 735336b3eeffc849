"""What studies have in common: running pipelines, reading their results and the published tables."""

import csv
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from benchmarks.command import run_mrfit

ROOT = Path(__file__).resolve().parent.parent.parent
PUBLISHED = Path(__file__).parent / "published"


@dataclass(frozen=True)
class Place:
    """Where a study reads its logs and works, and the rig that made the logs where it is not the study's own."""

    logs: Path
    work: Path
    rig: Any = field(default=None, compare=False)


def published(name: str) -> list[dict[str, str]]:
    """Return the rows of a published table; its first line says paper and table."""
    with (PUBLISHED / f"{name}.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def value(text: str) -> float | None:
    """Return a cell of a table as a number, None where it is empty."""
    return float(text) if text else None


def pipeline(name: str, place: Place) -> None:
    """Run a study's pipeline file on its logs; on another rig's without a report."""
    file = ROOT / "pipelines" / f"study-{name}.toml"
    if place.rig is not None:
        whole, file = file.read_text(encoding="utf-8"), place.work.with_suffix(".toml")
        file.write_text(whole.partition("[report]")[0], encoding="utf-8")
    run_mrfit(place.work, "run", str(file), "--log", str(place.logs))


def fit_file(work: Path, name: str) -> dict[str, Any]:
    """Return a fit's file."""
    whole: dict[str, Any] = json.loads((work / "fits" / name / "fit.json").read_text(encoding="utf-8"))
    return whole


def parameters(result: dict[str, Any]) -> dict[str, float]:
    """Return parameters and derived quantities of one result of a fit."""
    return {q["name"]: q["value"] for q in (*result["parameters"], *result["derived"])}


def errors(fit: dict[str, Any], kind: str, role: str = "train") -> dict[str, float]:
    """Return an error of every condition of a fit."""
    return {m["condition"]: m[kind] for m in fit["metrics"] if m["role"] == role}
