"""Small finished studies with closed-form outputs, as the fit stage leaves them in a workspace."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from mrfit.core.recording import Segment
from mrfit.io.atomic import write_atomic
from mrfit.io.workspace import Workspace, write_json
from mrfit.signal.metrics import error_sums

RATE = 400
CYCLES = 6
NOISE = 2e-4


def quantity(name: str, value: float, half: float | None, **more: Any) -> dict[str, Any]:
    low, high = (value - half, value + half) if half is not None else (None, None)
    row = {"name": name, "value": value, "unit": "1", "low": low, "high": high, "bound_low": 0.0, "bound_high": 500.0}
    return row | {"at_bound": False, "identifiable": half is not None, "fixed": False, "text": f"what {name} is"} | more


def coil_study(
    root: Path, frequencies: tuple[int, ...] = (1, 5, 10), currents: tuple[int, ...] = (1, 2, 3, 4, 5)
) -> Workspace:
    """A lossy saturating coil fitted per condition: λ = L·i0·tanh(i/i0) − h·cos ωt, plus a third harmonic."""
    workspace, rng = Workspace(root), np.random.default_rng(5)
    parts, segments, results = [], [], []
    for f in frequencies:
        for amplitude in currents:
            condition = f"sine-{f}Hz-{amplitude}A"
            name = f"coil-{f}Hz-{amplitude}A"
            phase = 2.0 * np.pi * np.arange(CYCLES * RATE) / RATE
            current = amplitude * np.sin(phase)
            loop = 6e-4 * amplitude * np.cos(phase)
            simulated = 0.06 * np.tanh(current / 3.0) - loop
            measured = simulated + 1e-4 * f * np.cos(3.0 * phase) + NOISE * rng.standard_normal(len(phase))
            segments.append(
                Segment(
                    f"{name}#0",
                    condition,
                    name,
                    100,
                    100 + len(phase),
                    100,
                    "sine",
                    "current",
                    float(f),
                    float(amplitude),
                    0.0,
                    CYCLES,
                    math.nan,
                    math.nan,
                    "train",
                )
            )
            for role, at in (("train", slice(0, 4 * RATE)), ("holdout", slice(4 * RATE, None))):
                time = np.arange(len(phase[at])) / (f * RATE)
                parts.append(
                    {
                        "condition": condition,
                        "segment": f"{name}#0",
                        "role": role,
                        "time": time,
                        "measured": measured[at],
                        "simulated": simulated[at],
                        "current": current[at],
                    }
                )
            results.append(coil_result(condition, f, amplitude))
    fit = {
        "model": "boucwen-flux",
        "optimizer": "pso-fmin",
        "per": "condition",
        "output": "flux",
        "inputs": ["current"],
    }
    fit |= {
        "equation": "λ = A·Lc·i + (1−A)·Lc·z/D\ndz/dt = κ·di/dt − β·|di/dt|·z & so on",
        "reference": "Tang et al., eq. 5",
    }
    write_fit(workspace, "boucwen-flux.pso-fmin", fit, results, parts)
    write_inputs(workspace, segments, {"current": "A", "voltage": "V"})
    return workspace


def coil_result(condition: str, frequency: int, amplitude: int) -> dict[str, Any]:
    evaluations = np.unique(np.geomspace(40, 6000, 60).astype(int))
    cost = 2e-4 * math.hypot(1.0, 0.35 * frequency)
    history = [[40, None], *([int(n), cost * (1.0 + 400.0 * amplitude / n)] for n in evaluations[1:])]
    parameters = [
        quantity("A", 1.2 + 0.01 * amplitude, None, text="share of the linear part"),
        quantity("Lc", 0.0234567 - 0.001 * amplitude, 0.00021, unit="H", text="coil inductance"),
        quantity("kappa", 3.5, None, unit="1/A", text="initial slope of z"),
        quantity("n", 1.0, 0.05, at_bound=True, bound_low=1.0, bound_high=10.0, text="sharpness of the knee"),
        quantity("D", 20.0, 0.0, fixed=True),
    ]
    derived = [
        quantity("slope", 0.0281234, 3.4e-5, unit="H", text="A*Lc: inductance where z is saturated"),
        quantity("amplitude", -2.34e-6, 4e-8, unit="Wb"),
    ]
    warnings = [
        {"kind": "not-identifiable", "text": "the data do not determine A, kappa one by one; read slope instead"},
        {"kind": "at-bound", "text": "n ended at a bound: widen --bounds or fix the parameter"},
    ]
    inductance = 0.0234567 - 0.001 * amplitude
    held = [inductance + 1.05e-4 * k for k in (-2.5, -2.0, -1.0, 0.0, 1.0, 2.0, 2.5)]
    rises = [0.98 * abs(k) for k in (-2.5, -2.0, -1.0, 0.0, 1.0, 2.0, 2.5)]
    return {
        "profiles": [{"name": "Lc", "values": held, "rises": rises, "quantile": 1.96}] if amplitude == 1 else [],
        "condition": condition,
        "conditions": [condition],
        "cost": cost,
        "evaluations": 6000,
        "budget": 6000,
        "stopped": "converged",
        "nonfinite": 0,
        "history": history,
        "starts": [cost, 2.0 * cost],
        "parameters": parameters,
        "derived": derived,
        "conditioning": {
            "rank": 3,
            "parameters": 4,
            "singular_values": [1.0, 0.1, 0.01, 1e-9],
            "null_directions": [{"A": 0.6, "kappa": -0.8}],
        },
        "passivity": [
            {
                "condition": condition,
                "loop_area": -1e-3 if amplitude == 5 else 1e-3,
                "unit": "J",
                "passive": amplitude != 5,
            }
        ],
        "warnings": warnings,
        "segments": [],
    }


def damper_study(root: Path, conditions: int = 3, name: str = "bingham.lsq.all") -> Workspace:
    """A Bingham damper with friction smoothed in the measurement, one joint fit, last condition held out."""
    workspace, rng = Workspace(root), np.random.default_rng(7)
    parts, segments = [], []
    for k in range(conditions):
        condition, amplitude, omega = f"sine-2Hz-0.01m-{0.5 * k}A", 0.01, 4.0 * np.pi
        phase = 2.0 * np.pi * np.arange(CYCLES * RATE) / RATE
        x, v = amplitude * np.sin(phase), amplitude * omega * np.cos(phase)
        force = (400.0 + 900.0 * k) * np.tanh(v / 0.01) + 3000.0 * v + 15.0 * rng.standard_normal(len(v))
        simulated = (400.0 + 900.0 * k) * np.sign(v) + 3000.0 * v
        role = "holdout" if conditions > 1 and k == conditions - 1 else "train"
        recording = f"damper-{k}"
        segments.append(
            Segment(
                f"{recording}#0",
                condition,
                recording,
                0,
                len(v),
                0,
                "sine",
                "displacement",
                2.0,
                amplitude,
                0.0,
                CYCLES,
                0.5 * k,
                24.5,
                role,
            )
        )
        time = np.arange(len(v)) / (2.0 * RATE)
        parts.append(
            {
                "condition": condition,
                "segment": f"{recording}#0",
                "role": role,
                "time": time,
                "measured": force,
                "simulated": simulated,
                "displacement": x,
                "velocity": v,
            }
        )
    result = coil_result("all", 2, 3) | {
        "conditions": [s.condition for s in segments],
        "derived": [],
        "warnings": [],
        "passivity": [],
    }
    result |= {
        "parameters": [
            quantity("fy", 1300.0, 12.5, unit="N", text="yield force <at rest>"),
            quantity("C_inf", 3012.0, 40.0, unit="N*s/m"),
        ],
        "conditioning": None,
    }
    fit = {
        "model": "bingham",
        "optimizer": "lsq",
        "per": "all",
        "output": "force",
        "inputs": ["displacement", "velocity"],
        "equation": "F = fy·sign v + C∞·v + f0",
    }
    write_fit(workspace, name, fit, [result], parts)
    write_inputs(workspace, segments, {"displacement": "m", "force": "N"})
    return workspace


def write_fit(
    workspace: Workspace, name: str, about: dict[str, Any], results: list[dict[str, Any]], parts: list[dict[str, Any]]
) -> None:
    import pandas as pd

    fit = {
        "schema": "mrfit/fit/1",
        "name": name,
        "seed": 3,
        "key": "k",
        "data_sha256": "0123456789abcdef" * 4,
        "versions": {"mrfit": "0.1.0"},
    }
    fit |= {
        "settings": {"weight": "none", "bounds": [["n", 1.0, 10.0]]},
        **about,
        "results": results,
        "metrics": metric_rows(parts),
    }
    frame = pd.concat([pd.DataFrame(p) for p in parts], ignore_index=True)
    folder = workspace.fit_folder(name)
    write_atomic(folder / "residuals.parquet", lambda p: frame.to_parquet(p, index=False))
    write_json(folder / "fit.json", fit)


def metric_rows(parts: list[dict[str, Any]]) -> list[dict[str, Any]]:
    rows = []
    for role in dict.fromkeys(p["role"] for p in parts):
        chosen = [p for p in parts if p["role"] == role]
        for condition, members in [*((p["condition"], [p]) for p in chosen), ("all", chosen)]:
            measured, simulated = (np.concatenate([m[c] for m in members]) for c in ("measured", "simulated"))
            name = "current" if "current" in members[0] else "displacement"
            drive = np.concatenate([m[name] for m in members])
            starts = np.cumsum([0, *(len(m["measured"]) for m in members[:-1])]).tolist()
            floor = NOISE if "current" in members[0] else 15.0
            rows.append(
                {
                    "condition": condition,
                    "role": role,
                    "samples": len(measured),
                    **error_sums(measured, simulated, drive, starts).measures(),
                    "noise_floor": floor,
                }
            )
    return rows


def write_inputs(workspace: Workspace, segments: list[Segment], units: dict[str, str]) -> None:
    channels = [{"name": n, "unit": u, "column": k + 1} for k, (n, u) in enumerate(units.items())]
    recordings = [
        {
            "id": s.recording,
            "source": f"logs/{s.recording}.csv",
            "sha256": "ab" * 32,
            "reader": "tektronix",
            "rows_kept": s.stop,
            "rows_refused": k,
        }
        | {
            "dt": 1e-3,
            "start": -0.5,
            "channels": channels,
            "condition": {},
            "findings": [],
            "history": ["resampled to 1 kHz"],
        }
        for k, s in enumerate(segments)
    ]
    recordings[0]["findings"] = [
        {"kind": "clipped", "channel": "current", "at": 0.25, "text": "12 samples lie at the end of the range <5 A>"}
    ]
    refused = [{"source": "logs/empty.csv", "reason": "no numeric rows", "remedy": "check the file"}]
    rows = [
        {
            "id": r["id"],
            "action": "integrated",
            "resistance": 2.5,
            "resistance_error": 0.01,
            "resistance_source": "estimated from energy per cycle over frequency",
        }
        | {
            "lambda0": -1.25e-3,
            "offset_volt": 2e-4,
            "drift": "cycle",
            "closure_rms": 3e-6,
            "loop_area": 1.5e-3,
            "loops": [],
        }
        for r in recordings[1:]
    ]
    if "voltage" in units:
        kept = {"id": recordings[0]["id"], "action": "measured flux kept"}
        flux = {"settings": {"rule": "trapezoid", "drift": "cycle"}, "resistance": 2.5, "recordings": [kept, *rows]}
        write_json(
            workspace.flux_json, flux | {"separation_text": ["3 A (1, 5, 10 Hz): loop area = 0.01 J static hysteresis"]}
        )
    write_json(workspace.ingest_json, {"recordings": recordings, "refused": refused})
    workspace.write_segments(segments, {"key": "s"})
