"""Every current of a real damper held out in turn: ``python -m benchmarks.current_press [--out FILE.md]``.

MRFIT_REAL_LOGS names the folder of the logs of the press; they are not part of the package. Each current in turn, and
two conditions inside the range, are held out of joint fits with default laws of current.

``--rows FILE.jsonl`` gets a row for every fit; what it has already is not fitted again. ``--old FILE.jsonl`` has those
of an older rule. ``--choice WORKSPACE …`` prints of other workspaces whether laws are chosen there.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import json  # noqa: E402
import subprocess  # noqa: E402
import sys  # noqa: E402
import tempfile  # noqa: E402
import time  # noqa: E402
from collections.abc import Sequence  # noqa: E402
from dataclasses import replace  # noqa: E402
from itertools import pairwise  # noqa: E402
from pathlib import Path  # noqa: E402
from typing import Any  # noqa: E402

import numpy as np  # noqa: E402

import mrfit.fit.stage as stage  # noqa: E402
from mrfit.core.recording import Segment  # noqa: E402
from mrfit.fit.select import load_recordings  # noqa: E402
from mrfit.io.dataset import Dataset  # noqa: E402
from mrfit.io.workspace import Workspace  # noqa: E402
from mrfit.simulate.current_levels import tested_currents, to_choose  # noqa: E402

MODELS = "bingham", "hysteretic-biviscous", "tanh", "boucwen", "spencer"
MAP = Path(__file__).parents[1] / "pipelines" / "maps" / "press.toml"
INSIDE = "sine-3Hz-5mm-0A", "sine-3Hz-5mm-0.5A"


def ingested(folder: Path) -> Workspace:
    """Return a workspace with the logs of the press."""
    logs = sorted((Path(os.environ["MRFIT_REAL_LOGS"]) / "mr_damper_utfsm" / "preprocessed").glob("*.txt"))
    for words in (["ingest", *map(str, logs), "--map", str(MAP)], ["segment", "--holdout", "none"]):
        command = [sys.executable, "-m", "mrfit.cli", *words, "--work", str(folder)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return Workspace(folder)


def left_out(segments: Sequence[Segment]) -> dict[str, list[str]]:
    """Return the conditions that are held out together, by name."""
    levels = sorted({round(s.current, 2) for s in segments})
    by_level = {f"{i:g} A": [s.condition for s in segments if abs(s.current - i) < 0.05] for i in levels}
    return {"two conditions inside": list(INSIDE), **by_level}


def fitted(data: Dataset, model: str) -> dict[str, Any]:
    """Return error held out, share of the range, laws and processor time of a joint fit with default laws."""
    began, settings = time.process_time(), stage.Settings(model, per="all")
    fit = stage.identify(data, settings, stage.origin_of(data, settings)).content
    held = next(m.nrmse for m in fit.metrics if (m.condition, m.role) == ("all", "holdout"))
    laws = fit.current_dependence.orders if fit.current_dependence else {}
    words = ",".join(f"{n}={o}" for n, o in laws.items())
    return {"error": held, "laws": words, "seconds": time.process_time() - began}


def rows_of(workspace: Workspace, target: Path | None) -> list[dict[str, Any]]:
    """Return a row for every model and what is held out, those of the target as they are."""
    segments = workspace.read_segments()
    recordings, rows = load_recordings(workspace, segments), read(target)
    done = {(r["held"], r["model"]) for r in rows}
    for name, conditions in left_out(segments).items():
        roles = [replace(s, role="holdout" if s.condition in conditions else "train") for s in segments]
        for model in (m for m in MODELS if (name, m) not in done):
            rows.append({"held": name, "model": model, **fitted(Dataset(roles, recordings), model)})
            if target:
                with target.open("a", encoding="utf-8") as stream:
                    stream.write(json.dumps(rows[-1]) + "\n")
    return rows


def read(path: Path | None) -> list[dict[str, Any]]:
    """Return the rows of a file, none where there is none."""
    return [json.loads(line) for line in path.read_text().splitlines()] if path and path.exists() else []


def page(rows: Sequence[dict[str, Any]], old: Sequence[dict[str, Any]]) -> str:
    """Return the tables: means by what is held out, and every fit."""
    before = {(r["held"], r["model"]): r["error"] for r in old}

    def mean(errors: Sequence[float]) -> str:
        return f"{100 * float(np.mean(errors)):.2f}" if errors else ""

    lines = ["| held out | old rule | default |", "| --- | --- | --- |"]
    names = list(dict.fromkeys(r["held"] for r in rows))
    currents = [n for n in names if n.endswith(" A")]
    several = {"every current in turn, mean": currents, "inner currents, mean": currents[1:-1]}
    for name, held in {**{n: [n] for n in names}, **several}.items():
        own = [r for r in rows if r["held"] in held]
        earlier = [before[key] for key in ((r["held"], r["model"]) for r in own) if key in before]
        lines.append(f"| {name} | {mean(earlier)} | {mean([r['error'] for r in own])} |")
    lines += ["", "| held out | model | old rule | default | laws |", "| --- | --- | --- | --- | --- |"]
    for r in rows:
        key = r["held"], r["model"]
        lines.append(f"| {key[0]} | {key[1]} | {mean([before[k] for k in (key,) if k in before])} | "
                     f"{mean([r['error']])} | `{r['laws'] or '0'}` |")  # fmt: skip
    return "\n".join(lines) + "\n"


def choice(folders: Sequence[str]) -> str:
    """Return a line for each workspace: the currents held in training, and whether laws are chosen by them."""
    lines = []
    for folder in folders:
        segments = (workspace := Workspace(Path(folder))).read_segments()
        currents = tested_currents(segments, load_recordings(workspace, segments))
        chosen = to_choose("tanh", "auto", currents)
        lines.append(f"{folder}: currents held {currents.levels}; laws of current are {'' if chosen else 'not '}chosen")
    return "\n".join(lines)


def main(words: Sequence[str]) -> None:
    """Fit what the file of rows lacks, and write the page."""
    if words[:1] == ["--choice"]:
        print(choice(words[1:]))
        return
    named = {name: Path(path) for name, path in pairwise(words) if name in ("--rows", "--old", "--out")}
    with tempfile.TemporaryDirectory() as folder:
        text = page(rows_of(ingested(Path(folder)), named.get("--rows")), read(named.get("--old")))
    if "--out" in named:
        named["--out"].write_text(TITLE + text, encoding="utf-8")
    else:
        print(text)


TITLE = """# Default laws of current of a real damper: every current held out

`python -m benchmarks.current_press [--out FILE.md]`

Ten sines of a damper on a press at five currents. Each current in turn, and two conditions inside the range, are held
out of joint fits. Errors are shares of the range of force in %, means over five models. At 0 and 1 A the laws go
beyond what was trained. *old rule*: laws of the roles, unless another is better by a third and by three standard
errors. Logs of the shaking table, of Keio and of NEES hold no current, so that no laws are chosen there.

"""

if __name__ == "__main__":
    main(sys.argv[1:])
