"""Effects with a state hidden beside an exact base: whether discovery names them, and with which values.

`python -m benchmarks.stateful_effects --seed 1 --count 40`
`python -m benchmarks.stateful_effects --seed 1 --count 40 --wrong-law`

Every case draws a base with its start values scattered, an effect with its own values, nine sine tests and noise. A
case is right if the effect is all that is named, or one of a set that the data do not tell apart. Beside a wrong law
discovery is given another base. Any law may remember the motion as the effect does, so a case is right if the effect is
named, or is said to be one that the law could imitate. Effects named beside it may be what the given law lacks.
"""

import argparse
import json
import time
from typing import Any
from zlib import crc32

import numpy as np

import mrfit
from mrfit.simulate.assembly import Assembly, assemble

BASES = ("dahl", "tanh", "guo", "biviscous")
# Least and greatest of each parameter, and whether over decades; a stroke is 14 mm at most
DRAWN: dict[str, dict[str, tuple[float, float, bool]]] = {
    "free-play": {"g": (0.8, 1.0, False), "w": (2e-4, 1.2e-3, True)},
    "backlash": {"d": (0.3, 1.0, False), "w": (3e-4, 2e-3, True), "p": (1.0, 5.0, True)},
    "slip-lock": {
        "zeta": (0.4, 0.9, False), "d": (6e-4, 3e-3, True), "q": (-0.2, 0.3, False), "w": (0.25, 0.6, True),
    },
    "degradation": {"delta": (3e-4, 2e-3, True), "r": (0.0, 4e-6, False)},
    "": {},
}  # fmt: skip
FREQUENCIES, STROKES = (0.7, 1.5, 3.0), (0.004, 0.008, 0.014)
PER_CYCLE, CYCLES = 300, 6


def values_of(whole: Assembly, effect: str, rng: np.random.Generator) -> np.ndarray:
    """Return parameters (K,): those of the base scattered about their starts, those of the effect drawn."""
    found = []
    for p in whole.spec.params:
        name = p.name.removeprefix(f"{effect}.")
        if effect and p.name != name:
            low, high, decades = DRAWN[effect][name]
            share = rng.uniform()
            found.append(low * (high / low) ** share if decades else low + share * (high - low))
        else:
            found.append(float(np.clip(p.start * np.exp(rng.uniform(-0.4, 0.4)), p.low, p.high)))
    return np.array(found)


def recordings(whole: Assembly, theta: np.ndarray, rng: np.random.Generator) -> list[mrfit.Recording]:
    """Return the logs of nine tests with noise of 0.2 to 0.5 % of the range."""
    made = []
    for frequency in FREQUENCIES:
        for stroke in STROKES:
            f, amplitude = frequency * rng.uniform(0.9, 1.1), stroke * rng.uniform(0.9, 1.1)
            t, w = np.arange(PER_CYCLE * CYCLES) / (PER_CYCLE * f), 2 * np.pi * f
            x, v = amplitude * np.sin(w * t), amplitude * w * np.cos(w * t)
            channels = {"displacement": x, "velocity": v, "acceleration": -(w**2) * x, "time": t}
            drive = np.stack([channels[n] for n in whole.spec.inputs])
            made.append((f"{frequency:g} Hz {1e3 * stroke:g} mm", t[1], x, whole.simulate(drive, theta[None], t[1])[0]))
    noise = rng.uniform(2e-3, 5e-3) * float(np.ptp(np.concatenate([force for *_, force in made])))
    return [
        mrfit.Recording.from_arrays(
            dt=dt,
            name=name,
            displacement=x + 1e-6 * rng.standard_normal(len(x)),
            force=force + noise * rng.standard_normal(len(x)),
        )
        for name, dt, x, force in made
    ]


def row_of(effect: str, seed: int, number: int, wrong_law: bool) -> dict[str, Any]:
    """Return what discovery says of a case."""
    rng = np.random.default_rng(crc32(f"{effect}-{seed}-{number}".encode()))
    base = str(rng.choice(BASES))
    whole = assemble(f"{base}+{effect}" if effect else base)
    theta = values_of(whole, effect, rng)
    logs = recordings(whole, theta, rng)
    given = str(rng.choice([b for b in BASES if b != base])) if wrong_law else base
    start = time.process_time()
    found = mrfit.discover(logs, given, progress=False)
    named = [e.name for e in found.effects]
    lawful = [*found.confounded.index] if wrong_law else []
    among = effect in (*found.ambiguous_set, *lawful) and set(named) <= {effect}
    nothing = not effect and not named and (wrong_law or found.verdict == "none")
    outcome = "right" if named == [effect] or (among and not named) or nothing else ""
    outcome = outcome or ("beside others" if effect in named else "wrong" if named else "not named")
    truth = dict(zip(whole.spec.names, theta.tolist(), strict=True))
    held = [
        p.low <= truth[f"{e.name}.{p.name}"] <= p.high
        for e in found.effects
        for p in e.parameters
        if e.name == effect and p.low is not None and p.high is not None
    ]
    own = {n: round(v, 7) for n, v in truth.items() if effect and n.startswith(effect)}
    return {
        "effect": effect, "base": base, "given": given, "number": number, "outcome": outcome,
        "verdict": found.verdict, "named": named, "set": list(found.ambiguous_set), "lawful": lawful,
        "truth": own, "intervals hold": held,
        "before": found.gap.before, "after": found.gap.after, "noise": found.gap.noise_floor,
        "seconds": round(time.process_time() - start, 1),
    }  # fmt: skip


def main() -> None:
    """Run the cases that are asked for, and count."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--count", type=int, default=40, help="spread evenly over the effects and none")
    parser.add_argument("--wrong-law", action="store_true", help="give discovery another base than the true one")
    given = parser.parse_args()
    rows = []
    for number in range(given.count):
        rows.append(row_of([*DRAWN][number % len(DRAWN)], given.seed, number, given.wrong_law))
        print(json.dumps(rows[-1]), flush=True)
    for effect in DRAWN:
        own = [r["outcome"] for r in rows if r["effect"] == effect]
        held = [h for r in rows if r["effect"] == effect for h in r["intervals hold"]]
        counts = ", ".join(f"{word} {own.count(word)}" for word in ("right", "beside others", "not named", "wrong"))
        print(f"{effect or 'nothing'}: {counts} of {len(own)}; intervals hold {sum(held)} of {len(held)}")


if __name__ == "__main__":
    main()
