"""Smoothed channels against exact ones: ``python -m benchmarks.smoothing [--against PATH] [--out FILE.md]``.

Ten seconds of each stroke, at three sampling rates and with five kinds of noise, pass through
``mrfit.signal.smoothing.smooth``.
Displacement, velocity and acceleration are compared with their exact values: rms errors in per cent of the amplitude
and of the true rms. A reversal too many or too few is one that the exact stroke does not have. The last column is what
the smoothed velocity does to a damper's force (a tanh in velocity plus a dashpot), in noise floors of 0.5 % of the
force's range. With ``--against`` the same is measured with the package of another checkout and put in front.
"""

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

SECONDS = 10.0
RATES = (200, 1000, 5000)
NOISES = ("0", "0.1 %", "1 %", "AR(1) 0.2 %", "quantised 0.05 %")
FIRST_SEED = 40_000
OVERSAMPLING = 4
# Knee of the tanh in shares of the rms velocity, and the noise floor in shares of the force's range
KNEE, FLOOR = 0.2, 0.005
COLUMNS = ("displacement %", "velocity %", "acceleration %", "reversals", "force, floors")

Array = np.ndarray
Motion = tuple[Array, Array | None, Array | None]


def sine(t: Array, phase: float, rng: np.random.Generator) -> Motion:
    """Return a sine of 1.3 Hz."""
    turn = 2 * np.pi * 1.3
    angle = turn * t + phase
    return np.sin(angle), turn * np.cos(angle), -(turn**2) * np.sin(angle)


def corners(t: Array, phase: float, ramp: float) -> Motion:
    """Return a trapezoid of 0.93 Hz whose ramps take a share of the cycle, 0.5 for a triangle, 0 for a square wave."""
    part = (0.93 * t + phase / (2 * np.pi)) % 1.0
    half, sign = part % 0.5, np.where(part < 0.5, 1.0, -1.0)
    if ramp == 0.0:
        return sign, None, None
    return (
        sign * np.where(half < ramp, 2 * half / ramp - 1, 1.0),
        sign * np.where(half < ramp, 2 * 0.93 / ramp, 0),
        None,
    )


def rounded(t: Array, phase: float, rng: np.random.Generator) -> Motion:
    """Return a trapezoid whose corners an actuator rounds within 16 ms, as the integral of tanh."""

    def softplus(s: Array) -> Array:
        return np.logaddexp(0.0, s)

    width, ramp, period = 0.004, 0.15 / 0.93, 1 / 0.93
    x, v, a = np.zeros(len(t)), np.zeros(len(t)), np.zeros(len(t))
    shift = phase / (2 * np.pi) * period
    for number in range(-1, int(SECONDS / period) + 2):
        for start, sign in ((number * period, 1), ((number + 0.5) * period, -1)):
            for corner, bend in ((start, sign), (start + ramp, -sign)):
                s = (t + shift - corner) / width
                step = 1 / (1 + np.exp(-np.clip(s, -500, 500)))
                x += bend * width * softplus(s)
                v += bend * step
                a += bend * step * (1 - step) / width
    middle = (x.max() + x.min()) / 2
    return 2 / ramp * (x - middle), 2 / ramp * v, 2 / ramp * a


def chirp(t: Array, phase: float, rng: np.random.Generator) -> Motion:
    """Return a sweep from 0.5 to 8 Hz."""
    growth = 7.5 / SECONDS
    rate = 2 * np.pi * (0.5 + growth * t)
    angle = 2 * np.pi * (0.5 * t + growth * t**2 / 2) + phase
    return np.sin(angle), rate * np.cos(angle), -(rate**2) * np.sin(angle) + 2 * np.pi * growth * np.cos(angle)


def filtered(t: Array, rng: np.random.Generator, response: Callable[[Array], Array]) -> Motion:
    """Return Gaussian noise through a filter, made in the frequency domain beyond the Nyquist frequency."""
    rate = (len(t) - 1) / (t[-1] - t[0])
    over = max(OVERSAMPLING, int(20_000 / rate))
    samples = 2 * len(t) * over
    s = 2j * np.pi * np.fft.rfftfreq(samples, 1 / (rate * over))
    white = rng.standard_normal(len(s)) + 1j * rng.standard_normal(len(s))
    spectrum = np.concatenate([[0.0], (response(s[1:]) * white[1:])])
    x, v, a = (np.fft.irfft(spectrum * s**k, samples)[: len(t) * over : over] for k in range(3))
    scale = 2.5 * np.std(x)
    return x / scale, v / scale, a / scale


def band_pass(t: Array, phase: float, rng: np.random.Generator) -> Motion:
    """Return noise in a sharp band from 1 to 12 Hz."""
    return filtered(t, rng, lambda s: ((np.abs(s) > 2 * np.pi) & (np.abs(s) < 24 * np.pi)).astype(complex))


def rough(t: Array, phase: float, rng: np.random.Generator) -> Motion:
    """Return noise from 1 to 12 Hz through a band-pass filter of fourth order, whose velocity is rough."""
    low, high = 2 * np.pi, 24 * np.pi
    wide, centre = high - low, low * high

    def response(s: Array) -> Array:
        u = (s**2 + centre) / (wide * s)
        return np.asarray(1 / (u**2 + np.sqrt(2) * u + 1))

    x, v, _ = filtered(t, rng, response)
    return x, v, None


def road(t: Array, phase: float, rng: np.random.Generator) -> Motion:
    """Return the damper stroke of a quarter car on an ISO 8608 road, whose profile falls with 1/f."""
    sprung, unsprung, spring, damping, tyre = 300.0, 40.0, 2e4, 1.5e3, 1.8e5

    def response(s: Array) -> Array:
        body = sprung * s**2 + damping * s + spring
        wheel = unsprung * s**2 + damping * s + spring + tyre
        stroke = tyre * sprung * s**2 / (wheel * body - (damping * s + spring) ** 2)
        return stroke / (s + 0.6)

    x, v, _ = filtered(t, rng, response)
    return x, v, None


SIGNALS: dict[str, tuple[Callable[[Array, float, np.random.Generator], Motion], float]] = {
    "sine": (sine, 1.3),
    "triangle": (lambda t, p, r: corners(t, p, 0.5), 0.93),
    "trapezoid": (lambda t, p, r: corners(t, p, 0.15), 0.93),
    "rounded trapezoid": (rounded, 0.93),
    "square (current)": (lambda t, p, r: corners(t, p, 0.0), 0.93),
    "chirp": (chirp, 0.0),
    "band-pass, sharp": (band_pass, 0.0),
    "band-pass, 4th order": (rough, 0.0),
    "road, quarter car": (road, 0.0),
}


def noisy(x: Array, kind: str, rng: np.random.Generator) -> Array:
    """Return a stroke with noise in shares of its amplitude."""
    from scipy.signal import lfilter

    amplitude = float(np.ptp(x)) / 2
    if kind.startswith("AR"):
        noise = lfilter([np.sqrt(1 - 0.81)], [1, -0.9], rng.standard_normal(len(x) + 200))[200:]
        return np.asarray(x + 0.002 * amplitude * noise)
    if kind.startswith("quantised"):
        step = 0.0005 * amplitude
        return np.asarray(np.round(x / step) * step)
    share = float(kind.rstrip(" %")) / 100
    return np.asarray(x + share * amplitude * rng.standard_normal(len(x)))


@dataclass(frozen=True)
class Case:
    """One stroke at one rate with one noise."""

    signal: str
    rate: int
    noise: str

    def measured(self, seed: int) -> list[float | None]:
        """Return the columns of the table, by the ``mrfit`` that is on the path."""
        from mrfit.core.recording import Recording, Segment
        from mrfit.signal.smoothing import smooth

        make, frequency = SIGNALS[self.signal]
        rng = np.random.default_rng([FIRST_SEED + seed, self.rate])
        t = np.arange(int(SECONDS * self.rate)) / self.rate
        x, v, a = make(t, rng.uniform(0, 2 * np.pi), rng)
        channel, names = ("current", ["current"]) if v is None else ("displacement", ["displacement", "velocity"])
        names += ["acceleration"] if a is not None else []
        recorded = noisy(x, self.noise, rng)
        log = Recording("log", "log.csv", "0", "csv", 1 / self.rate, 0.0, {channel: recorded}, {})
        shape, cycles = ("periodic", int(SECONDS * frequency)) if frequency else ("random", 0)
        level = float("nan")
        part = Segment(
            "log#1", "c", "log", 0, len(t), 0, shape, channel, frequency, 1.0, 0.0, cycles, level, level, "train"
        )
        found = smooth(log, part, names).values
        row: list[float | None] = [100 * rms(found[0] - x) / (float(np.ptp(x)) / 2)]
        row += [100 * rms(f - e) / rms(e) if e is not None else None for f, e in zip(found[1:], (v, a), strict=False)]
        row += [None] * (3 - len(row)) + [float(reversals(found[0]) - reversals(x))]
        row.append(None if v is None else rms(force(found[1], v) - force(v, v)) / (FLOOR * float(np.ptp(force(v, v)))))
        return row


def rms(values: Array) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))


def force(velocity: Array, exact: Array) -> Array:
    """Return a damper's force with as much yield force as viscous force at the peak."""
    scale = rms(exact)
    return np.tanh(velocity / (KNEE * scale)) + velocity / float(np.max(np.abs(exact)))


def reversals(values: Array) -> int:
    """Return how often a signal turns, but for plateaus and rounding errors."""
    steps = np.diff(np.round(values / (1e-9 * np.ptp(values))))
    return int(np.sum(np.diff(np.sign(steps[steps != 0])) != 0))


def cases() -> list[Case]:
    """Return all cases in the table's order."""
    return [Case(signal, rate, noise) for signal in SIGNALS for rate in RATES for noise in NOISES]


def results(seeds: int) -> list[list[float | None]]:
    """Return the mean of every column over the seeds, case by case."""
    rows = []
    for case in cases():
        runs = [case.measured(seed) for seed in range(seeds)]
        columns = zip(*runs, strict=True)
        rows.append([None if c[0] is None else float(np.mean([n for n in c if n is not None])) for c in columns])
    return rows


def against(checkout: Path, seeds: int) -> list[list[float | None]]:
    """Return what this file measures with the package of another checkout."""
    command = [sys.executable, str(Path(__file__).resolve()), "--json", "--seeds", str(seeds)]
    path = {**os.environ, "PYTHONPATH": str(checkout.resolve())}
    run = subprocess.run(command, check=True, capture_output=True, text=True, env=path, cwd=checkout)
    rows: list[list[float | None]] = json.loads(run.stdout)
    return rows


def commit(checkout: Path) -> str:
    """Return the short name of a checkout's commit."""
    command = ["git", "-C", str(checkout), "rev-parse", "--short", "HEAD"]
    return "commit " + subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


def table(new: list[list[float | None]], old: list[list[float | None]] | None) -> str:
    """Return the results as a Markdown table; the other checkout's stand in front of the arrows."""
    lines = ["| signal | Hz | noise | " + " | ".join(COLUMNS) + " |", "|---|---|---|" + "---|" * len(COLUMNS)]
    for k, case in enumerate(cases()):
        cells = []
        for column, value in enumerate(new[k]):
            before = "" if old is None or value is None else f"{old[k][column]:.3g} → "
            cells.append("–" if value is None else before + f"{value:.3g}")
        lines.append(f"| {case.signal} | {case.rate} | {case.noise} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main() -> None:
    """Measure and print or write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--against", type=Path, help="another checkout, whose results stand in front of the arrows")
    parser.add_argument("--seeds", type=int, default=2, help="records of each case")
    parser.add_argument("--out", type=Path, help="Markdown file to write")
    parser.add_argument("--json", action="store_true", help="print numbers only")
    options = parser.parse_args()
    if options.json:
        print(json.dumps(results(options.seeds)))
        return
    old = against(options.against, options.seeds) if options.against else None
    said = f"Means of {options.seeds} records of each case."
    if options.against:
        said += f" In front of the arrows: the package as of {commit(options.against)}, on the same records."
    text = f"# Smoothing\n\n{__doc__}\n{said}\n\n{table(results(options.seeds), old)}\n"
    if options.out:
        options.out.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
