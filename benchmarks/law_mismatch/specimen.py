"""A specimen on a rig: its law, what is hidden in it, its tests, and the records a logger makes of them."""

from dataclasses import asdict, dataclass, replace

import numpy as np
from scipy.signal import lfilter

from benchmarks.law_mismatch import laws
from benchmarks.law_mismatch.currents import VARYING, Current, Stairs
from benchmarks.law_mismatch.faults import ADDED, LIBRARY, OF_CURRENT, Bench, Fault, State, draw, force
from benchmarks.law_mismatch.laws import Law, Scales, between
from benchmarks.law_mismatch.motions import DRIVES, Array, Drive, Motion, Rng

RATES = (200.0, 250.0, 500.0, 1000.0, 2000.0, 5000.0)
# Fine steps in a period of the middle frequency, and the periods before a record starts
FINE, LEAD = 2000, 1.5
SAMPLES = 60_000
# Faults whose strength is drawn as such and not for a size: the force they make is large, but short
AS_DRAWN = ("current-lag", "backlash")


@dataclass(frozen=True)
class Test:
    """One condition: motion (about the middle), current, temperature at the start and after it (degC)."""

    motion: Motion
    current: Current
    cold: float
    warm: float


@dataclass(frozen=True)
class Sensors:
    """Noise as shares of the ranges: white and coloured of force, white of displacement and current; offsets (SI)."""

    white: float
    coloured: float
    displacement: float
    current: float
    force_offset: float
    middle: float


@dataclass(frozen=True)
class Specimen:
    """All there is of a case before it is logged.

    Attributes
    ----------
    law, faults
        What it is.
    tests, kind, switching
        What it goes through, the kind of the motions and of the currents.
    rate, fine
        Samples a second; fine steps a sample.
    drive
        Scales.
    sensors
        What the logger adds.
    seed
        Of its noise.
    """

    law: Law
    faults: tuple[Fault, ...]
    tests: tuple[Test, ...]
    kind: str
    switching: str
    rate: float
    fine: int
    drive: Drive
    sensors: Sensors
    seed: int

    def states(self, fine: int = 0) -> list[State]:
        """Return every test in fine steps from before its start; ``fine`` replaces the steps a sample."""
        h = 1 / self.rate / (fine or self.fine)
        before = round(LEAD / self.drive.frequency * self.rate) * (fine or self.fine)
        count = round(self.drive.duration * self.rate) * (fine or self.fine)
        t = np.arange(-before, count) * h
        mean = float(np.mean([(q.cold + q.warm) / 2 for q in self.tests]))
        made = []
        for k, test in enumerate(self.tests):
            x, v, a = test.motion.at(t)
            warmth = _temperature(test, t, self.drive.duration) - mean
            made.append(State(t, x, v, a, test.current.at(t), warmth, h, k))
        return made

    def forces(self, faults: tuple[Fault, ...], fine: int = 0, offset: float = 0.0) -> list[Array]:
        """Return the force of every test at the sample times, with an offset of the load cell (N) and no noise."""
        steps = fine or self.fine
        return [force(self.law, s, faults, offset)[s.t > -0.5 * s.h][::steps] for s in self.states(steps)]


def _temperature(test: Test, t: Array, duration: float) -> Array:
    return test.cold + (test.warm - test.cold) * (1 - np.exp(-1.5 * np.maximum(t, 0) / duration)) / (1 - np.exp(-1.5))


@dataclass(frozen=True)
class Log:
    """One record as logged, SI and degC, each (N,)."""

    dt: float
    displacement: Array
    force: Array
    current: Array
    temperature: Array


def logs(specimen: Specimen) -> list[Log]:
    """Return what the logger makes of a specimen's tests."""
    rng, made = np.random.default_rng([specimen.seed, 9]), []
    forces = specimen.forces(specimen.faults, offset=specimen.sensors.force_offset)
    span = max(f.max() for f in forces) - min(f.min() for f in forces)
    top, e = max(1e-3, specimen.law.field.top), specimen.sensors
    for s, f in zip(specimen.states(), forces, strict=True):
        kept = s.t > -0.5 * s.h
        x, i, warmth = (q[kept][:: specimen.fine] for q in (s.x, s.i, s.warmth))
        hum = lfilter([np.sqrt(1 - 0.98**2)], [1.0, -0.98], rng.standard_normal(len(x) + 200))[200:]
        mean = float(np.mean([(q.cold + q.warm) / 2 for q in specimen.tests]))
        made.append(
            Log(
                1 / specimen.rate,
                x + e.middle + e.displacement * specimen.drive.stroke * rng.standard_normal(len(x)),
                f + span * (e.white * rng.standard_normal(len(x)) + e.coloured * hum),
                i + e.current * top * rng.standard_normal(len(x)),
                warmth + mean + 0.03 * rng.standard_normal(len(x)),
            )
        )
    return made


def specimen(
    split: str, family: str, hidden: tuple[str, ...], seed: int, memory: float = 1.0, conditions: int = 0
) -> tuple[Specimen, dict]:
    """Return a specimen with effects hidden in it, and the truth about them: name -> values, size ….

    ``memory`` is 1 for a law that forgets in time, else its yield travel over the half-stroke. ``conditions`` is their
    number, 0 for one drawn from 6 to 20.
    """
    rng = np.random.default_rng([seed, 1])
    kind = str(rng.choice(list(DRIVES[split])))
    modes = [*VARYING] if any(n in OF_CURRENT for n in hidden) else ["constant", *VARYING]
    switching = str(rng.choice(modes))
    rate = float(rng.choice(RATES))
    frequency = min(rate / rng.uniform(100, 400), 15.0)
    stroke = min(between(rng, 4e-3, 30e-3), 0.9 / (4 * np.pi * frequency))
    drawn = int(rng.integers(6, 21))
    count = conditions or drawn
    duration = min(max(8 / frequency, 2000 / rate), max(SAMPLES / count / rate, 5 / frequency))
    drive = Drive(stroke, frequency, duration)
    tests, top = _plan(split, kind, switching, drive, count, rng)
    speed = _speed(tests, drive)
    full = between(rng, 50, 5000)
    law = laws.draw(family, Scales(stroke, speed, full), top, np.random.default_rng([seed, 2]), memory)
    sensors = Sensors(
        between(rng, 5e-4, 8e-3), between(rng, 2e-4, 4e-3), between(rng, 1e-5, 3e-4), between(rng, 2e-4, 3e-3),
        float(rng.choice([0.0, 1.0])) * rng.uniform(-0.1, 0.1) * full, rng.uniform(-0.3, 0.3) * stroke,
    )  # fmt: skip
    fine = max(1, int(np.ceil(FINE * frequency / rate)))
    bare = Specimen(law, (), tests, kind, switching, rate, fine, drive, sensors, seed)
    reached = sorted(float(np.abs(s.x).max()) for s in bare.states(1))
    bench = Bench(stroke, reached[-2], speed, top, frequency, 1 / rate)
    truth, found, noise = {}, [], np.hypot(sensors.white, sensors.coloured)
    for k, name in enumerate(hidden):
        fault, truth[name] = _sized(bare, name, bench, np.random.default_rng([seed, 3, k]))
        truth[name]["contrast"] = truth[name]["rms"] / noise
        found.append(fault)
    return replace(bare, faults=tuple(found)), truth


def _plan(split: str, kind: str, switching: str, drive: Drive, count: int, rng: Rng) -> tuple[tuple[Test, ...], float]:
    top = between(rng, 0.5, 5.0)
    levels = top * np.concatenate([[0.0], np.sort(rng.uniform(0.15, 0.85, rng.integers(1, 4))), [1.0]])
    sizes, factors = (1.0, rng.uniform(0.55, 0.75), rng.uniform(0.25, 0.45)), (0.5, 1.0, rng.uniform(1.5, 2.0))
    tests, warm = [], rng.uniform(0, 15)
    offset = rng.integers(0, 9)
    for k in range(count):
        # every amplitude with every frequency in turn, the development drives on a grid, the others scattered about it
        size, factor = sizes[(k + offset) % 3], factors[((k + offset) // 3) % 3]
        if split == "evaluation":
            size, factor = size * rng.uniform(0.85, 1.0), factor * rng.uniform(0.85, 1.15)
        motion = DRIVES[split][kind](drive, rng, size, factor)
        held = Stairs((0.0,), (float(levels[k % len(levels)]),))
        vary = VARYING.get(switching)
        # a few tests at a constant level stand beside those with a varying one
        if vary is None or (k % 4 == 3 and count > 7):
            current = held
        else:
            current = vary(levels, drive.duration, drive.frequency, rng)
        cold = rng.uniform(18, 50)
        tests.append(Test(motion, current, cold, cold + warm * rng.uniform(0.3, 1)))
    return tuple(tests), float(top)


def _speed(tests: tuple[Test, ...], drive: Drive) -> float:
    t = np.linspace(0, drive.duration, 3000)
    return float(max(np.percentile(np.abs(q.motion.at(t)[1]), 99) for q in tests))


def size_of(bare: Specimen, fault: Fault, plain: list[Array] | None = None) -> tuple[float, float]:
    """Return the largest force that a fault makes and its root mean square, over the range of the force without it."""
    plain = plain or bare.forces(())
    span = max(f.max() for f in plain) - min(f.min() for f in plain)
    extra = np.concatenate([a - b for a, b in zip(bare.forces((fault,)), plain, strict=True)]) / span
    return float(np.abs(extra).max()), float(np.sqrt(np.mean(extra**2)))


def _sized(bare: Specimen, name: str, bench: Bench, rng: Rng) -> tuple[Fault, dict]:
    """Return a fault of 2 to 20 % of the range (a lag: of 8 to 60 ms), and what is true of it."""
    fault, most = draw(name, bench, rng)
    asked, plain = between(rng, 0.02, 0.2), bare.forces(())
    size, rms = size_of(bare, fault, plain)
    for _ in range(8):
        if name in AS_DRAWN or abs(size / asked - 1) < 0.01 or (size < asked and abs(fault.strength) >= most):
            break
        strength = fault.strength * min(max(asked / max(size, 1e-12), 1e-6), 1e6)
        fault = replace(fault, strength=float(np.clip(strength, -most, most)))
        size, rms = size_of(bare, fault, plain)
    return fault, {"values": _values(bare, fault), "size": size, "rms": rms, "asked": asked, "fault": asdict(fault)}


def _values(bare: Specimen, fault: Fault) -> dict[str, float]:
    """Return the parameters that are judged, as the library means them, in SI."""
    strength = fault.strength
    if fault.name == "asymmetry":
        # factor 1 + e*tanh = (1 - e)*(1 + g*(1 + tanh)/2)
        return {"g_yield": 2 * strength / (1 - strength)}
    if fault.name == "end-stop":
        return {"peak": float(max(np.abs(ADDED["end-stop"](s, fault)).max() for s in bare.states(1)))}
    if fault.name == "slow-release":
        return {"tau": fault.shape["tau"], "share": strength}
    return {LIBRARY[fault.name][1]: strength} if fault.name in LIBRARY else {}
