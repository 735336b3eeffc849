"""Race every optimizer and the usual chains on every model: ``python -m benchmarks.optimizers [MODEL,… [OPT,…]]``.

Each model meets data planted by itself, and by a richer model that it cannot follow; models of flux and current also
``datasets/coil``, and where MRFIT_REAL_LOGS names a folder of instrument logs, a real damper and a real transformer
loop: the first and the last condition of each. All optimizers start at the same points: the model's own and those the
data give. Seconds are those of the process, since the machine may be shared; of ``auto``, which takes milliseconds, the
least of several runs counts. Named models may be ``all``, and ``auto`` always runs.
"""

import csv
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sys  # noqa: E402
import tempfile  # noqa: E402
import time  # noqa: E402
from collections.abc import Iterator  # noqa: E402
from pathlib import Path  # noqa: E402

import numpy as np  # noqa: E402

from benchmarks.command import COIL, run_mrfit  # noqa: E402
from benchmarks.planted import problem  # noqa: E402
from mrfit.cli.catalog import read_catalog  # noqa: E402
from mrfit.core import registry  # noqa: E402
from mrfit.errors import MrfitError  # noqa: E402
from mrfit.fit import stage as fit_stage  # noqa: E402
from mrfit.fit.identify import FitGroup, SearchSettings, build_group, search_optimum  # noqa: E402
from mrfit.fit.select import read_dataset  # noqa: E402
from mrfit.io.workspace import Workspace  # noqa: E402
from mrfit.search.cube import Cube  # noqa: E402
from mrfit.search.starts import at_scales, data_starts, to_points  # noqa: E402
from mrfit.simulate.assembly import Assembly, assemble  # noqa: E402

SAMPLES = 6000
# Least runs of ``auto``, and least seconds of them together
REPEATS, REPEATED = 4, 0.3
# What plants data that models of the same output cannot follow
RICHER = {"force": "spencer", "torque": "rotational-hybrid", "flux": "boucwen-flux+eddy-current"}
DAMPER = "mr_damper_utfsm"
LOOP_MAP = '[channels]\ncurrent = {column = "CH1", unit = "A"}\nflux = {column = "CH2", unit = "Wb"}\n'
# Workspaces: name, folder or file of logs, channel map
REAL = (
    (DAMPER, f"{DAMPER}/preprocessed", read_catalog()[DAMPER].map),
    ("rigol_bh_loop", "rigol_bh_loop/histerese_osciloscopio_80.csv", LOOP_MAP),
)

Problem = tuple[FitGroup, Assembly, Cube]


def contestants() -> list[str]:
    """Return all optimizers and the usual chains, ``auto`` first."""
    return ["auto", *registry.names("optimizer"), "pso-fmin", "cma-lsq", "mwoa-lsq"]


def planted(models: list[str]) -> Iterator[tuple[str, str, Problem]]:
    """Yield model, name of the data, and the problem, for data that are made."""
    for model in models:
        yield model, "own", problem(model, 1, SAMPLES, np.random.default_rng(1))
        richer = RICHER.get(assemble(model).spec.output, model)
        if richer.partition("+")[0] != model:
            yield model, richer, problem(richer, 1, SAMPLES, np.random.default_rng(2), fitted=model)


def measured(
    models: list[str], name: str, logs: Path, mapping: str, folder: Path
) -> Iterator[tuple[str, str, Problem]]:
    """Yield model, name of the data and the problem for the first and the last condition of logs, of all models."""
    commands: list[list[str]] = [["ingest", str(logs)]]
    if mapping:
        (folder / "map.toml").write_text(mapping)
        commands[0] += ["--map", str(folder / "map.toml")]
    for command in (*commands, ["flux"], ["segment"]):
        if command == ["flux"] and "force" in mapping:
            continue
        run_mrfit(folder, *command)
    for model in models:
        try:
            prepared = fit_stage.prepare(read_dataset(Workspace(folder)), fit_stage.Settings(model))
        except MrfitError:
            continue
        names = list(prepared.groups)
        for condition in dict.fromkeys((names[0], names[-1])):
            segments = prepared.groups[condition]
            group = build_group(condition, segments, prepared.recordings, prepared.assembly, split=True)
            yield model, f"{name} {condition}", (group, prepared.assembly, prepared.cube)


def problems(models: list[str]) -> Iterator[tuple[str, str, Problem]]:
    """Yield every model with every data set it suits."""
    yield from planted(models)
    logs = os.environ.get("MRFIT_REAL_LOGS")
    sets = [("coil", COIL, ""), *((name, Path(logs) / path, text) for name, path, text in REAL if logs)]
    for name, path, mapping in sets:
        with tempfile.TemporaryDirectory() as folder:
            yield from measured(models, name, path, mapping, Path(folder))


def race(posed: Problem, names: list[str]) -> dict[str, tuple[float, float]]:
    """Return cost and seconds of each optimizer."""
    group, assembly, cube = posed
    base = assemble(assembly.name.partition("+")[0])
    cube = at_scales(cube, group.training, base)
    starts = to_points(cube, [{}, *data_starts(group.training, base, None, ())])
    found = {}
    for name in names:
        settings = SearchSettings(name, 0, None, None, "none")
        seconds: list[float] = []
        # the first run compiles kernels, and several of a short one show what it takes
        while not seconds or (name == "auto" and (len(seconds) < REPEATS or sum(seconds[1:]) < REPEATED)):
            begin = time.process_time()
            cost = search_optimum(group, assembly, cube, starts, settings, lambda evaluations, best: None).cost
            seconds.append(time.process_time() - begin)
        found[name] = (float(cost), min(seconds))
    return found


def main(models: list[str], names: list[str]) -> None:
    """Print each optimizer's error over the least one, and its time over that of auto."""
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow(["model", "data", "auto ms", *(f"{n} {c}" for n in names for c in ("error", "time"))])
    excess, slower = [], []
    for model, data, posed in problems(models):
        found = race(posed, names)
        best, own = min(cost for cost, _ in found.values()), found["auto"][1]
        excess.append([found[n][0] / best - 1.0 for n in names])
        slower.append([found[n][1] / own for n in names])
        cells = [f"{v:.4g}" for pair in zip(excess[-1], slower[-1], strict=True) for v in pair]
        writer.writerow([model, data, f"{1e3 * own:.1f}", *cells])
        sys.stdout.flush()
    print(
        f"\n{len(excess)} problems: share within 0.1 % of the least error, worst error; in units of auto's time median,"
    )
    print("least, and the number of problems on which it is 50 or more")
    for k, name in enumerate(names):
        errors, times = (np.array([row[k] for row in rows]) for rows in (excess, slower))
        shown = f"{np.mean(errors <= 1e-3):6.0%} {errors.max():10.2%} {np.median(times):8.0f} {times.min():8.1f}"
        print(f"{name:10s} {shown} {np.count_nonzero(times >= 50.0):4d}")


if __name__ == "__main__":
    chosen = sys.argv[1].split(",") if len(sys.argv) > 1 and sys.argv[1] != "all" else []
    others = ["auto", *sys.argv[2].split(",")] if len(sys.argv) > 2 else contestants()
    main(chosen or registry.names("model"), others)
