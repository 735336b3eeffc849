"""A proposed formula as its plug-in: the contracts, the joint fit with the base, and the export in C."""

from __future__ import annotations

import json
from pathlib import Path

from benchmarks.second_rig.__main__ import MOST_PROCESSOR_TIME, run_command
from mrfit.discover.formula.plugin import NAME, source
from mrfit.discover.formula.proposal import Proposal
from mrfit.discover.writing.formula import PLUGIN_FILE

from .specimen import Specimen

EXACT = 1e-9  # share of the output's range by which C may differ from Python


def plugged(folder: Path, specimen: Specimen, found: Proposal) -> dict[str, object]:
    """Write the plug-in of a proposal and use it by the documented commands; return what came, and where it stopped.

    ``errors`` are those of the base and of base and formula on held-out tests over the range, ``strengths`` the
    fitted ones over those that were proposed, ``differs`` that of C from Python over the range.
    """
    assert found.rows and found.formula
    specimen.write(folder)
    plugin, work = folder / PLUGIN_FILE, folder / "work"
    plugin.write_text(source(found.rows, found.formula))
    used = ["--plugin", str(plugin), "--work", str(work)]
    models = {"base": specimen.base, "whole": f"{specimen.base}+{NAME}"}
    fits = [["fit", "--model", m, "--name", n, "--per", "all", *used] for n, m in models.items()]
    export = ["export", "--fit", "whole", "--to", "c", "--json", *used]
    steps = {
        "contracts": ([str(plugin)], "mrfit.contracts"),
        "ingest": (["ingest", str(folder / "logs"), "--work", str(work)], "mrfit.cli"),
        "fit of the base": (fits[0], "mrfit.cli"),
        "joint fit": (fits[1], "mrfit.cli"),
        "export": (export, "mrfit.cli"),
    }
    for name, (arguments, module) in steps.items():
        log = folder / f"{name}.txt"
        if run_command(arguments, log, MOST_PROCESSOR_TIME, module)[0] != 0:
            return {"stopped": name, "why": (log.read_text().strip().splitlines() or [""])[-1]}
    said = (folder / "export.txt").read_text()
    told = json.loads(said[said.index("{\n") :])  # a warning may stand before it
    base, both = (json.loads((work / "fits" / n / "fit.json").read_text()) for n in models)
    values = {p["name"]: p["value"] for p in both["results"][0]["parameters"]}
    theta = found.formula.theta * found.rows.scales["L"].size
    return {
        "errors": [
            next((m["nrmse"] for m in fit["metrics"] if m["role"] == "holdout" and m["nrmse"]), None)
            for fit in (base, both)
        ],
        "strengths": [float(values[f"{NAME}.f{k + 1}"] / t) for k, t in enumerate(theta)],
        "differs": told["formats"][0]["error"],
    }
