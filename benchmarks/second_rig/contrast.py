"""How much of a hidden effect the base cannot absorb, and how much of it no other effect could have made."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .motions import FINE_RATE
from .physics import Damper, Details, Strengths, Test, simulate

# effects that a hidden one may be mistaken for, each alone
RIVALS = {
    "current-lag": ("slow-release", "residual-magnetism", "delay"),
    "residual-magnetism": ("slow-release", "current-lag"),
    "inertia": ("linear-spring", "delay"),
    "gas-spring": ("inertia", "delay"),
    "stribeck": ("coulomb-friction", "delay"),
    "coulomb-friction": ("stribeck", "delay"),
    "velocity-hysteresis": ("delay", "inertia", "linear-spring"),
    "asymmetry": ("delay",),
    "temperature": ("quadratic-drag",),
}


def forces(damper: Damper, tests: Sequence[Test], on: Strengths, details: Details, every: int) -> np.ndarray:
    """Return the force (N) of all tests, one after the other, each fine sample of ``every``."""
    return np.concatenate([simulate(damper, test, on, details)[0][::every] for test in tests])


def base_columns(damper: Damper, tests: Sequence[Test], every: int) -> np.ndarray:
    """Return the sensitivities of the force to all that a fit of the base adapts.

    They are the law's two parts times powers of the current, an offset, a stiffness where the law has one, and finite
    differences of the law's shape.
    """
    powers = 4 if any(np.std(test.current) > 0.05 for test in tests) else _levels(tests)
    law, columns = damper.law, []
    parts = [law.parts(t.motion.x, t.motion.v, damper.shape) for t in tests]
    current = np.concatenate([t.current[::every] for t in tests]) / damper.field.greatest
    for part in (0, 1):
        shape = np.concatenate([p[part][::every] for p in parts])
        columns += [shape * current**k for k in range(powers if part == 0 else min(powers, 3))]
    columns.append(np.ones(current.size))
    if law.spring:
        columns.append(np.concatenate([t.motion.x[::every] for t in tests]))
    plain = replace(damper, drift=0.0, ripple=0.0)
    now = forces(plain, tests, {}, Details(), every)
    for name, value in damper.shape.items():
        moved = replace(plain, shape={**damper.shape, name: value * 1.02 + 1e-9})
        columns.append(forces(moved, tests, {}, Details(), every) - now)
    return np.stack(columns, axis=1)


def _levels(tests: Sequence[Test]) -> int:
    return min(len({round(float(np.mean(test.current)), 1) for test in tests}), 4)


def unabsorbed(columns: np.ndarray, change: np.ndarray) -> float:
    """Root mean square of a change of the force that is left beside the columns."""
    scaled = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-12)
    left = change - scaled @ np.linalg.lstsq(scaled, change, rcond=1e-10)[0]
    return float(np.sqrt(np.mean(left**2)))


def _rival_strengths(rival: str, lag_time: float, width: float) -> list[float]:
    """Strengths of a rival at which its direction is taken; those that act linearly need one."""
    if rival in ("slow-release", "current-lag"):
        return [0.5 * lag_time, lag_time, 3 * lag_time]
    return {"residual-magnetism": [0.5 * width, width], "delay": [2 / FINE_RATE]}.get(rival, [1.0])


def told_apart(
    damper: Damper, tests: Sequence[Test], on: Strengths, details: Details, name: str, columns: np.ndarray, every: int
) -> tuple[float, str]:
    """Return what is left of a hidden effect (N) beside the base and its nearest rival, and which rival that is."""
    whole = forces(damper, tests, on, details, every)
    without = {k: s for k, s in on.items() if k != name}
    bare = forces(damper, tests, without, details, every)
    change = whole - bare
    lag_time = on.get("current-lag", 0.01)
    width = 0.05 * damper.field.greatest
    least, nearest = unabsorbed(columns, change), "base"
    for rival in RIVALS.get(name, ()):
        if rival in on:
            continue
        for strength in _rival_strengths(rival, lag_time, width):
            direction = forces(damper, tests, {**without, rival: strength}, details, every) - bare
            left = unabsorbed(np.column_stack([columns, direction]), change)
            if left < least:
                least, nearest = left, rival
    return least, nearest
