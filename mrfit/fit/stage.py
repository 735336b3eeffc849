"""The fit stage: segments and a model name in, identified parameters with errors and intervals out."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

import numpy as np

from mrfit import optimize
from mrfit.assembly import Assembly, assemble
from mrfit.errors import ConfigError
from mrfit.fit.cube import Cube, cube_of
from mrfit.fit.identify import Group, SearchSettings, build_group, search_optimum, uncertainty_of
from mrfit.fit.result import (
    conditioning,
    derived_rows,
    metric_rows,
    parameter_rows,
    passivity_rows,
    simulate_block,
    warnings_of,
)
from mrfit.progress import Progress, silent
from mrfit.recording import Recording, Segment
from mrfit.specs import Array
from mrfit.store import Workspace, key_of, plain, read_json, write_atomic, write_json

SCHEMA = "mrfit/fit/1"


@dataclass(frozen=True)
class Settings:
    """What to fit and how.

    Attributes
    ----------
    model
        Model as written on the command line.
    optimizer
        Optimizer chain, as in ``pso-fmin``.
    per
        ``condition``: one set of parameters for each condition, its last third of cycles held out; ``all``: one set for
        all training conditions, whole conditions held out.
    name
        Name of the fit; empty for MODEL.OPT (MODEL.OPT.all for a joint fit).
    seed
        Seed of every random choice.
    budget
        Evaluations allowed for each set of parameters, or None for the optimizers' own.
    seconds
        Wall-clock limit for each set of parameters, or None.
    weight
        ``none``: every sample counts alike; ``floor``: errors count in multiples of their condition's noise floor,
        which is most accurate where noise limits the fit; ``range``: errors count as shares of their condition's range.
    bounds, start, fixed
        The user's changes to the model's own, by parameter name.
    jobs
        Worker threads; does not change the result.
    """

    model: str
    optimizer: str = "auto"
    per: Literal["condition", "all"] = "condition"
    name: str = ""
    seed: int = 0
    budget: int | None = None
    seconds: float | None = None
    weight: Literal["none", "floor", "range"] = "none"
    bounds: tuple[tuple[str, float, float], ...] = ()
    start: tuple[tuple[str, float], ...] = ()
    fixed: tuple[tuple[str, float], ...] = ()
    jobs: int = 1

    @property
    def fit_name(self) -> str:
        """Name of the fit's folder."""
        return self.name or f"{self.model}.{self.optimizer}" + (".all" if self.per == "all" else "")


def run(workspace: Workspace, settings: Settings, progress: Progress = silent) -> dict[str, Any]:
    """Fit a model to the workspace's segments and write ``fits/NAME``.

    Parameters
    ----------
    workspace
        Holds segments and recordings.
    settings
        What to fit and how.
    progress
        Told of every condition's evaluations.

    Returns
    -------
    dict
        Content of fit.json, with ``skipped`` telling whether it was there already.

    Raises
    ------
    ConfigError
        If a model, optimizer or parameter name or a bound is wrong.
    DataError
        If the recordings lack what the model needs or every simulation diverges.
    """
    assembly, cube = check(settings)
    segments, _ = workspace.read_segments()
    recordings = load_recordings(workspace, segments)
    data = {i: (r.sha256, r.history) for i, r in sorted(recordings.items())}
    key = key_of({**asdict(settings), "jobs": 0}, data, [asdict(s) for s in segments])
    folder = workspace.fit_folder(settings.fit_name)
    existing = read_json(folder / "fit.json")
    if existing and existing.get("key") == key:
        return {**existing, "skipped": True}
    runner = _Runner(assembly, cube, settings, folder, key, progress)
    pieces = runner.fit_groups(_groups(segments, settings), recordings)
    fit = _summary(assembly, settings, key, key_of(data), pieces)
    _write(folder, fit, pieces, assembly)
    return {**plain(fit), "skipped": False}


def check(settings: Settings) -> tuple[Assembly, Cube]:
    """Return the model and its cube, before any data are touched.

    Raises
    ------
    ConfigError
        If a model, optimizer or parameter name, a bound or the fit's name is wrong.
    """
    assembly = assemble(settings.model)
    optimize.chain(settings.optimizer)
    if "/" in settings.fit_name or settings.fit_name.startswith("."):
        raise ConfigError(f"'{settings.fit_name}' cannot name a fit: it names a folder, so no slash and no leading dot")
    bounds = {n: (low, high) for n, low, high in settings.bounds}
    return assembly, cube_of(assembly.spec, bounds, dict(settings.start), dict(settings.fixed))


def load_recordings(workspace: Workspace, segments: Sequence[Segment]) -> dict[str, Recording]:
    """Return the recordings the segments point into, with flux where the flux stage has run."""
    stage = "flux" if workspace.flux_json.is_file() else "recordings"
    return {i: workspace.read_recording(i, stage) for i in dict.fromkeys(s.recording for s in segments)}


def _groups(segments: Sequence[Segment], settings: Settings) -> dict[str, list[Segment]]:
    if settings.per == "all":
        return {"all": list(segments)}
    conditions = dict.fromkeys(s.condition for s in segments)
    return {c: [s for s in segments if s.condition == c] for c in conditions}


@dataclass(frozen=True)
class _Piece:
    """What one group's fit came to."""

    result: dict[str, Any]
    group: Group
    simulated: list[Array]
    metrics: list[dict[str, Any]]


@dataclass(frozen=True)
class _Runner:
    """Fits groups, keeping every finished search on disk until the whole fit is written: a kill loses little."""

    assembly: Assembly
    cube: Cube
    settings: Settings
    folder: Path
    key: str
    progress: Progress

    def fit_groups(self, groups: dict[str, list[Segment]], recordings: dict[str, Recording]) -> list[_Piece]:
        with ThreadPoolExecutor(max(1, self.settings.jobs)) as pool:
            futures = [pool.submit(self._fit, name, segments, recordings) for name, segments in groups.items()]
            try:
                return [f.result() for f in futures]
            except BaseException:
                pool.shutdown(wait=True, cancel_futures=True)
                raise

    def _fit(self, name: str, segments: list[Segment], recordings: dict[str, Recording]) -> _Piece:
        settings = self.settings
        group = build_group(name, segments, recordings, self.assembly, split=settings.per == "condition")
        search = SearchSettings(settings.optimizer, settings.seed, settings.budget, settings.seconds, settings.weight)
        found = self._resumed(name) or self._search(group, search)
        point = np.array(found["point"])
        theta = self.cube.to_theta(point[None, :])[0]
        outputs = [simulate_block(b, self.assembly, theta) for b in group.full]
        simulated = [output for output, _ in outputs]
        uncertainty = uncertainty_of(group, self.assembly, self.cube, point, settings.weight)
        metrics = metric_rows(group.full, group.floors, simulated, self.assembly)
        result = {
            "condition": name,
            "conditions": list(dict.fromkeys(b.segment.condition for b in group.full)),
            "at": {k: getattr(group.full[0].segment, k) for k in ("frequency", "amplitude", "current")},
            **{k: found[k] for k in ("cost", "evaluations", "budget", "budget_spent", "stopped", "nonfinite")},
            **{k: found[k] for k in ("history", "starts", "agreeing")},
            "parameters": parameter_rows(self.cube, point, uncertainty),
            "derived": derived_rows(self.assembly, self.cube, point, uncertainty),
            "conditioning": conditioning(self.cube, uncertainty),
            "passivity": passivity_rows(group.full, simulated, self.assembly),
            "segments": [
                {"id": b.segment.id, "condition": b.segment.condition, "role": b.segment.role}
                | {"drive": b.method, "offset": offset, "noise_floor": floor}
                for b, (_, offset), floor in zip(group.full, outputs, group.floors, strict=True)
            ],
        }
        result["warnings"] = warnings_of(result, metrics)
        return _Piece(result, group, simulated, metrics)

    def _search(self, group: Group, search: SearchSettings) -> dict[str, Any]:
        name = group.name
        total = search.budget or optimize.default_budget(search.optimizer, len(self.cube.free))

        def told(evaluations: int, cost: float) -> None:
            unit = self.assembly.spec.output
            self.progress(f"{name}  best {cost:.3g} {unit}", min(evaluations, total - 1), total)

        found = search_optimum(group, self.assembly, self.cube, search, told)
        self.progress(f"{name}  best {found['cost']:.3g} {self.assembly.spec.output}", total, total)
        write_json(self._partial(name), {"key": self.key, "condition": name, "found": found})
        return found

    def _partial(self, name: str) -> Path:
        return self.folder / ".partial" / f"{key_of(name)[:24]}.json"

    def _resumed(self, name: str) -> dict[str, Any] | None:
        stored = read_json(self._partial(name))
        return dict(stored["found"]) if stored and stored.get("key") == self.key else None


def _summary(
    assembly: Assembly, settings: Settings, key: str, data_key: str, pieces: Sequence[_Piece]
) -> dict[str, Any]:
    spec = assembly.spec
    return {
        "schema": SCHEMA,
        "name": settings.fit_name,
        "model": settings.model,
        "optimizer": settings.optimizer,
        "per": settings.per,
        "seed": settings.seed,
        "key": key,
        "data_sha256": data_key,
        "versions": {p: version(p) for p in ("mrfit", "numpy", "scipy", "numba")},
        "settings": {k: v for k, v in asdict(settings).items() if k != "jobs"},
        "output": spec.output,
        "inputs": list(spec.inputs),
        "equation": spec.equation,
        "reference": spec.reference,
        "results": [p.result for p in pieces],
        "metrics": _all_metrics(pieces, assembly),
    }


def _all_metrics(pieces: Sequence[_Piece], assembly: Assembly) -> list[dict[str, Any]]:
    if len(pieces) == 1:
        return pieces[0].metrics
    blocks = [b for p in pieces for b in p.group.full]
    floors = [f for p in pieces for f in p.group.floors]
    return metric_rows(blocks, floors, [s for p in pieces for s in p.simulated], assembly)


def _write(folder: Path, fit: dict[str, Any], pieces: Sequence[_Piece], assembly: Assembly) -> None:
    """Write a fit's folder; fit.json comes last, since its key says that the rest is there."""
    import shutil

    import pandas as pd

    columns = ["condition", "parameter", "value", "unit", "low", "high", "at_bound", "identifiable"]
    rows = [
        {"condition": r["condition"], "parameter": p["name"], **p}
        for r in fit["results"]
        for p in [*r["parameters"], *r["derived"]]
    ]
    parameters, metrics = pd.DataFrame(rows)[columns], pd.DataFrame(fit["metrics"])
    write_atomic(folder / "parameters.csv", lambda p: parameters.to_csv(p, index=False))
    write_atomic(folder / "metrics.csv", lambda p: metrics.to_csv(p, index=False))
    residuals = pd.concat([f for piece in pieces for f in _residual_frames(piece, assembly)], ignore_index=True)
    write_atomic(folder / "residuals.parquet", lambda p: residuals.to_parquet(p, compression="zstd", index=False))
    write_json(folder / "fit.json", fit)
    shutil.rmtree(folder / ".partial", ignore_errors=True)


def _residual_frames(piece: _Piece, assembly: Assembly) -> list[Any]:
    import pandas as pd

    frames = []
    for block, simulated in zip(piece.group.full, piece.simulated, strict=True):
        segment = block.segment
        inputs = {n: block.inputs(row) for row, n in enumerate(assembly.spec.inputs)}
        columns: dict[str, Any] = {"condition": segment.condition, "segment": segment.id, "role": segment.role}
        columns |= {"time": np.arange(block.samples) * block.dt, "measured": block.target, "simulated": simulated}
        frames.append(pd.DataFrame({**columns, **inputs}))
    return frames
