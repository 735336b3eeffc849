"""The methods that are judged, each asked through its own interface: all of discovery, or parts of it."""

import importlib.util
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

import mrfit
from benchmarks.law_mismatch.examination import findings, said
from benchmarks.law_mismatch.motions import Array
from benchmarks.law_mismatch.said import Name, Number, Said


@dataclass(frozen=True)
class Asked:
    """Records as logged (SI) and the base to discover from.

    ``channels`` are those of one record after another, ``dt`` their sample intervals (s), ``condition`` what is known
    of each besides.
    """

    channels: Sequence[dict[str, Array]]
    dt: Sequence[float]
    base: str
    condition: Sequence[dict[str, float]] = ()

    @property
    def reach(self) -> tuple[float, float]:
        """Lowest and highest displacement (m)."""
        x = [c["displacement"] for c in self.channels if "displacement" in c]
        return (min(map(np.min, x)), max(map(np.max, x))) if x else (0.0, 0.0)


def ask(method: str, asked: Asked, prototype: Path | None) -> Said:
    """Return what a method says, with the time it took; its failure is a verdict too."""
    wall, cpu = time.perf_counter(), time.process_time()
    try:
        said = METHODS[method](asked, prototype)
    # whatever a method fails of is its result
    except Exception as error:  # noqa: BLE001
        said = Said("error", why={"error": f"{type(error).__name__}: {error}"[:300]})
    return replace(said, seconds=round(time.perf_counter() - wall, 3), cpu=round(time.process_time() - cpu, 3))


def recordings_of(asked: Asked) -> list[mrfit.Recording]:
    """Return the records as a user gives them to mrfit."""
    conditions = asked.condition or [{}] * len(asked.channels)
    return [
        mrfit.Recording.from_arrays(dt=dt, name=f"test{k:02d}", condition=known, **channels)
        for k, (channels, dt, known) in enumerate(zip(asked.channels, asked.dt, conditions, strict=True))
    ]


def _discover(asked: Asked, prototype: Path | None) -> Said:
    found = mrfit.discover(recordings_of(asked), model=asked.base).to_json()
    open_law = found.get("invariance") or {}
    forces = {e["name"]: [e["force"]] for e in open_law.get("named", ()) if e.get("force")}
    names = tuple(
        Name(e["name"], _with_peak(e["name"], _numbers(e["parameters"]), _numbers(forces.get(e["name"], [])), asked))
        for e in found["effects"]
    )
    why = {c["name"]: str(c["reason"]) for c in found["candidates"] if not c["accepted"]}
    why |= {c["name"]: str(c["reason"]) for c in open_law.get("turned_down", ())}
    broken = tuple(b["invariance"] for b in open_law.get("broken", ()))
    weak = {
        c["name"]: {p["name"]: p["value"] for p in c.get("parameters", ())} for c in open_law.get("turned_down", ())
    }
    return Said(str(found["verdict"]), names, tuple(found["ambiguous_set"]), broken, why=why, weak=weak)


def _numbers(parameters: list[dict[str, Any]]) -> dict[str, Number]:
    return {p["name"]: Number(p["value"], p["low"], p["high"]) for p in parameters}


def _with_peak(name: str, found: dict[str, Number], force: dict[str, Number], asked: Asked) -> dict[str, Number]:
    """Return the numbers of an effect with the largest force of an end stop: as told, or made of its numbers."""
    numbers = dict(found)
    if name == "end-stop" and force:
        numbers["peak"] = next(iter(force.values()))
    elif name == "end-stop":
        low, high = asked.reach
        x_s, x_m, p = (numbers[q].value for q in ("x_s", "x_m", "p"))
        deep = max(high - x_m - x_s, x_m - x_s - low, 0.0)
        unit = 1e-3 * (deep / 1e-3) ** p
        numbers["peak"] = _scaled(numbers["k_s"], unit)
    return numbers


def _scaled(number: Number, unit: float) -> Number:
    ends = (None if q is None else q * unit for q in (number.low, number.high))
    return Number(number.value * unit, *ends)


@cache
def _module(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location("law_mismatch_prototype", path)
    if spec is None or spec.loader is None:
        raise ImportError(f"{path} is no Python file")
    module = importlib.util.module_from_spec(spec)
    # its dataclasses look their module up
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def _prototype(asked: Asked, prototype: Path | None) -> Said:
    if prototype is None:
        raise ValueError("--method prototype needs --prototype FILE.py")
    records = []
    for k, (channels, dt) in enumerate(zip(asked.channels, asked.dt, strict=True)):
        force = channels["force"]
        known = asked.condition[k] if asked.condition else {}
        records.append(
            {
                "t": np.arange(len(force)) * dt, "x": channels.get("displacement"), "v": channels.get("velocity"),
                "F": force, "i": channels.get("current", np.full(len(force), known.get("current", 0.0))),
                "T": channels.get("temperature"),
            }
        )  # fmt: skip
    answer = _module(prototype).discover(records, asked.base)
    names = tuple(_of_prototype(e, answer, asked) for e in answer.named)
    verdict = "named" if names else "unexplained" if answer.before > 1.5 * answer.floor else "none"
    return Said(verdict, names, why={n: str(w) for n, w in answer.turned_down.items()})


def _of_prototype(effect: Any, answer: Any, asked: Asked) -> Name:
    value, half = effect.value, effect.half
    ends = (value, value - half, value + half)
    if effect.name in ("gas-spring", "inertia"):
        numbers = {"k_g" if effect.name == "gas-spring" else "m": Number(*ends)}
    elif effect.name == "asymmetry":
        numbers = {"g_yield": Number(*(2 * min(q, 0.99) / (1 - min(q, 0.99)) for q in ends))}
    elif effect.name == "end-stop":
        force = [c["force"] for c in asked.channels]
        peak = effect.size * (max(map(np.max, force)) - min(map(np.min, force)))
        numbers = {"peak": Number(*(peak * q / value for q in ends))}
    elif effect.name == "residual-magnetism":
        late = abs(value - effect.shape[1]) < abs(value - effect.shape[0])
        numbers = {"tau" if late else "share": Number(*ends)}
    else:
        parameter = {"temperature": "b_yield", "gain-drift": "g", "current-lag": "tau", "residual-play": "w"}
        top = max(np.abs(c["current"]).max() for c in asked.channels) if effect.name == "residual-play" else 1.0
        numbers = {parameter[effect.name]: _scaled(Number(*ends), top)}
    name = {"residual-play": "residual-magnetism", "residual-magnetism": "slow-release"}.get(effect.name, effect.name)
    return Name(name, numbers, tuple(answer.rivals.get(effect.name, ())))


def _invariance(asked: Asked, prototype: Path | None) -> Said:
    found = findings(recordings_of(asked), asked.base)
    forces = {e.name: Number(e.force.value, e.force.low, e.force.high) for e in found.named}
    told = said(found)
    names = (replace(n, numbers=_with_peak(n.name, n.numbers, {"force": forces[n.name]}, asked)) for n in told.names)
    return replace(told, names=tuple(names))


METHODS: dict[str, Callable[[Asked, Path | None], Said]] = {
    "discover": _discover,
    "invariance": _invariance,
    "prototype": _prototype,
}
