"""Public records that take minutes: fits of the prototype damper, and discovery on all records."""

import json
import os
from pathlib import Path
from typing import Any

from benchmarks.command import run_mrfit
from benchmarks.studies.page import Row, Study, Table
from benchmarks.studies.real import log_words
from benchmarks.studies.runs import ROOT, errors, fit_file

# What their authors reached, and by what
AUTHORS = {
    "press": "not asked by the authors",
    "keio": "not asked by the authors",
    "table": "Dahl models, four errors of 21 to 37 % in the authors' sheet; no effect is named there",
    "prototype": "no error and no effect is reported of this record",
}


def prototype_table(work: Path) -> Table:
    """Return the errors of the prototype damper after 18 s."""
    rows = []
    for model in ("boucwen", "boucwen+current-lag"):
        held = errors(fit_file(work / "prototype", f"{model}.auto.all"), "nrmse", "holdout")["all"]
        rows.append(Row(model, [], [100.0 * held]))
    note = "NRMSE in % after 18 s, held out. Its authors report no error of this record."
    return Table("Prototype damper (NEES-2012-1158)", "nothing published", "model", [""], rows, note)


def discovered(work: Path, name: str, authors: str) -> Row:
    """Return what the discovery in a workspace says of a record, beside what its authors say."""
    found: dict[str, Any] = json.loads((work / "discover" / "discovery.json").read_text(encoding="utf-8"))
    effects = ", ".join(e["name"] for e in found["effects"]) or "no effect"
    before, after = (100.0 * found["gap"][k] for k in ("before", "after"))
    said = f"{found['verdict']}: {effects}; held-out error {before:.3g} %, then {after:.3g} % of the range"
    return Row(f"{name}, from {found['base_model']}", [], [], words=(authors, said))


def run(logs: Path, work: Path) -> Study | None:
    """Run the study, or return None where the real logs are absent."""
    root = Path(os.environ.get("MRFIT_REAL_LOGS", ""))
    if not os.environ.get("MRFIT_REAL_LOGS") or not root.is_dir():
        return None
    found, own = [], "prototype"
    run_mrfit(work / own, "run", str(ROOT / "pipelines" / f"study-{own}.toml"), *log_words(root, own))
    for name, said in AUTHORS.items():
        words = log_words(root, name)
        place = work / f"{name}-discovery"
        run_mrfit(place, "run", str(ROOT / "pipelines" / f"study-{name}-discovery.toml"), *words)
        found.append(discovered(place, name, said))
    return Study(
        "real-long",
        "The prototype damper, and discovery on public records",
        "UTFSM press, Keio, labcontrol shaking table, NEES-2012-1158",
        "Real logs, not shipped; by `make studies-long`, skipped where `MRFIT_REAL_LOGS` names no folder of them.",
        [f"mrfit run pipelines/study-{name}.toml --log …" for name in (own, *(f"{n}-discovery" for n in AUTHORS))],
        [prototype_table(work), Table("What discovery says", "mrfit discover", "record", [], found)],
    )
