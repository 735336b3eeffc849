"""The coil's bench: which voltages drive it, what the scope's channels see, and the files it saves."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from datasets.rig import coil as stop_coil
from datasets.rig import flux_coil
from datasets.rig import noise as noises
from datasets.rig.coil import Coil, CoilRun
from datasets.rig.envelope import Envelope
from datasets.rig.flux_coil import FluxCoil
from datasets.rig.scope import LEVELS_PER_DIVISION, Probe, acquire, vertical_scale, write
from datasets.rig.stop import Array
from datasets.rig.style import Style

PERIODS = 20
PER_PERIOD = 250
OVERSAMPLING = 4
CLAMP = 0.1
INTEGRATOR = 50.0
VOLTAGE_NOISE, CURRENT_NOISE, INTEGRATOR_NOISE = 3e-3, 3e-4, 5e-3
CLIP_KNEE = 3.2
NOMINAL_INDUCTANCE = 0.018


@dataclass(frozen=True, slots=True)
class Drive:
    """One log: ``sine`` or ``square`` voltage, frequency in Hz, nominal current amplitude in A, repeat.

    ``envelope`` is the factor on the voltage's amplitude over the cycles.
    """

    shape: str
    frequency: float
    amplitude: float
    repeat: int = 0
    envelope: Envelope | None = None

    @property
    def name(self) -> str:
        """File name without its ending."""
        again = f"_{self.repeat}" if self.repeat else ""
        return f"{self.shape}_{self.frequency:g}Hz_{self.amplitude:g}A{again}"


def _sines(frequencies: tuple[float, ...], amplitudes: tuple[float, ...]) -> list[Drive]:
    return [Drive("sine", f, a) for f in frequencies for a in amplitudes]


PROGRAMMES: dict[str, Callable[[], list[Drive]]] = {
    "rich": lambda: [
        *_sines((1, 5, 10), (1, 2.5, 5)),
        *_sines((40,), (1.5,)),
        Drive("square", 5, 3),
        Drive("square", 40, 2),
    ],
    "one-frequency": lambda: [Drive("sine", 5, a, k) for k in (1, 2, 3) for a in (1, 2, 3.5, 5)],
    "narrow-band": lambda: _sines((4, 5, 6), (1, 2, 3.5, 5)),
    "one-log": lambda: [Drive("sine", 5, 3)],
    "two-logs": lambda: _sines((5,), (2, 4)),
}


@dataclass(frozen=True, slots=True)
class CoilRecord:
    """What probes and clamp present to the converters, before noise; arrays (runs, samples)."""

    drives: list[Drive]
    interval: Array
    voltage: Array
    current: Array
    integrated: Array
    """Flux linkage as an electronic integrator shows it, Wb."""


def run(coil: FluxCoil | Coil, magnitudes: Mapping[str, float], drives: list[Drive]) -> CoilRecord:
    """Drive the coil and return what the instruments present."""
    frequency = np.array([d.frequency for d in drives])
    steps = PERIODS * PER_PERIOD * OVERSAMPLING
    phase = 2 * np.pi * np.arange(2 * steps + 1) / (2 * PER_PERIOD * OVERSAMPLING)
    shapes = {"sine": np.sin(phase), "square": np.tanh(np.sin(phase) / 0.3)}
    impedance = np.hypot(coil.resistance + coil.output_resistance, 2 * np.pi * frequency * NOMINAL_INDUCTANCE)
    emf = np.array([d.amplitude * z * shapes[d.shape] for d, z in zip(drives, impedance, strict=True)])
    emf = emf * [d.envelope(phase / (2 * np.pi), 0) if d.envelope else np.ones_like(phase) for d in drives]
    step = 1.0 / (frequency * PER_PERIOD * OVERSAMPLING)
    true = _solved(coil, magnitudes, emf, step)
    seen = clamped(true.current, magnitudes, step)
    time = step[:, None] * np.arange(steps + 1)
    drift = magnitudes.get("integrator-offset", 0.0) * time
    kept = slice(0, steps, OVERSAMPLING)
    return CoilRecord(drives, step * OVERSAMPLING, true.voltage[:, kept], seen[:, kept], (true.flux + drift)[:, kept])


def _solved(coil: FluxCoil | Coil, magnitudes: Mapping[str, float], emf: Array, step: Array) -> CoilRun:
    """Return the true signals at every step of an EMF given at every half step."""
    if isinstance(coil, FluxCoil):
        return flux_coil.solve(coil, flux_coil.Effects.of(magnitudes), emf, step, keep=1)
    return stop_coil.solve(replace(coil, eddy=magnitudes.get("eddy-current", coil.eddy)), emf[:, ::2], step, keep=1)


def clamped(current: Array, magnitudes: Mapping[str, float], step: Array) -> Array:
    """Return the current as the clamp shows it: late, and compressed on one side."""
    count = np.arange(current.shape[1])
    late = magnitudes.get("probe-skew", 0.0) / step
    shown = np.array([np.interp(count - k, count, row) for k, row in zip(late, current, strict=True)])
    beyond = np.maximum(shown - CLIP_KNEE, 0.0)
    compressed: Array = shown - magnitudes.get("clamp-compression", 0.0) * beyond
    return compressed


def save(record: CoilRecord, folder: Path, style: Style, rng: np.random.Generator) -> tuple[Array, Array]:
    """Write one scope file per log; return the voltage (V) and current (A) noise that was added, (runs, samples)."""
    drawn = [
        noises.draw(style.noise, _level(signal, gain, front_end), signal.shape[1], record.interval, rng)
        for signal, gain, front_end in (
            (record.voltage, 1.0, VOLTAGE_NOISE),
            (record.current, CLAMP, CURRENT_NOISE),
            (record.integrated, INTEGRATOR, INTEGRATOR_NOISE),
        )
    ]
    names = style.names([drive.name for drive in record.drives])
    for k, name in enumerate(names):
        probes = (
            Probe(style.sign, float(rng.normal(8e-3, 3e-3))),
            Probe(style.sign * CLAMP, float(rng.normal(-1e-3, 3e-4))),
            Probe(style.sign * INTEGRATOR, float(rng.normal(0.0, 0.05))),
        )
        signals = (record.voltage[k], record.current[k], record.integrated[k])
        count = 3 if style.integrator else 2
        taken = [acquire(s, p, n[k]) for s, p, n in list(zip(signals, probes, drawn, strict=True))[:count]]
        channels = {f"CH{c + 1}": values[:: style.stride] for c, (values, _) in enumerate(taken)}
        write(folder / f"{name}.csv", 0.0, float(record.interval[k]) * style.stride, channels, taken[0][1])
    return drawn[0], drawn[1] / CLAMP


def _level(signal: Array, gain: float, front_end: float) -> Array:
    """Return the noise of a channel in each run, V: its front end's and one level of the range the scope is set to."""
    levels = [vertical_scale(gain * float(peak)) / LEVELS_PER_DIVISION for peak in np.abs(signal).max(axis=1)]
    return np.hypot(front_end, levels)


def channel_map(resistance: float, style: Style) -> str:
    """Return the channel map (TOML) a lab would write for these logs."""
    scale, unit = (1e3 / CLAMP, "mA") if style.other_units else (1 / CLAMP, "A")
    lines = [
        f"resistance = {resistance:.6g}",
        "",
        "[channels]",
        'voltage = {column = "CH1"}',
        f'current = {{column = "CH2", scale = {scale:.1f}, unit = "{unit}"}}',
    ]
    if style.integrator:
        lines.append(f'flux = {{column = "CH3", scale = {1 / INTEGRATOR:g}, unit = "Wb"}}')
    return "\n".join(lines) + "\n"
