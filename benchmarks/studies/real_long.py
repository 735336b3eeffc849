"""Discovery on the public records that take minutes: the shaking table, and the prototype damper."""

import os
from pathlib import Path

from benchmarks.command import run_mrfit
from benchmarks.studies.page import Study
from benchmarks.studies.real import SETS, discovered, discovery_table
from benchmarks.studies.runs import ROOT

# What their authors reached, and by what
AUTHORS = {
    "table": "Dahl models, four errors of 21 to 37 % in the authors' sheet; no effect is named there",
    "prototype": "no error and no effect is reported of this record",
}


def run(logs: Path, work: Path) -> Study | None:
    """Run the study, or return None where the real logs are absent."""
    root = Path(os.environ.get("MRFIT_REAL_LOGS", ""))
    if not os.environ.get("MRFIT_REAL_LOGS") or not root.is_dir():
        return None
    found = []
    for name, said in AUTHORS.items():
        words = [word for f in SETS[name] for word in ("--log", str(root / f))]
        place = work / f"{name}-discovery"
        run_mrfit(place, "run", str(ROOT / "pipelines" / f"study-{name}-discovery.toml"), *words)
        found.append(discovered(place, name, said))
    return Study(
        "real-long",
        "Discovery on the shaking table and the prototype damper",
        "labcontrol shaking table, NEES-2012-1158",
        "Real logs, not shipped; by `make studies-long`, skipped where `MRFIT_REAL_LOGS` names no folder of them.",
        [f"mrfit run pipelines/study-{name}-discovery.toml --log …" for name in AUTHORS],
        [discovery_table(found)],
    )
