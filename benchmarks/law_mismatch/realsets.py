"""Real records, and what is planted in their force: the sizes are shares of the range over the whole set."""

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from zlib import crc32

import numpy as np
from scipy.signal import savgol_filter

import mrfit
from benchmarks.law_mismatch.methods import Asked
from benchmarks.law_mismatch.motions import Array
from benchmarks.law_mismatch.protocol import OWN_SPRING, Case
from mrfit.cli.catalog import read_catalog

# coil currents of the shaking table's series by the first letter or number of parts of the name; its sheet gives the
# voltages 0, 0.8712, 1.98 and 3.212 V and the current of the last two, 0.45 and 0.495 A
_TABLE_CURRENTS = {"A": 0.495, "B": 0.45, "2": 0.198, "1": 0.0}


@dataclass(frozen=True)
class RealSet:
    """A set of real logs: files, channel map, current of each file where none is logged, pieces each is cut into."""

    files: tuple[str, ...]
    channel_map: str
    pieces: int = 1
    current: Callable[[str], float] | None = None
    position: bool = True


def _table_current(stem: str) -> float:
    parts = stem.split(".")
    return _TABLE_CURRENTS[parts[1] if len(parts) > 2 and parts[1] in "AB" else parts[-1]]


_TABLE = ("A.1", "A.5", "A.9", "B.1", "B.5", "B.9", "2.2.2", "5.2.2", "8.2.2", "3.1", "5.1", "9.1")
SETS = {
    "press": RealSet(("mr_damper_utfsm/preprocessed/*.txt",), read_catalog()["mr_damper_utfsm"].map),
    "table": RealSet(
        tuple(f"mr_damper_labcontrol/ensaio{'.' * n[0].isalpha()}{n}.mat" for n in _TABLE),
        read_catalog()["mr_damper_labcontrol"].map,
        current=_table_current,
    ),
    "nees": RealSet(
        ("mr_damper_nees_dyke/ranran_50_converted.csv",),
        '[channels]\ndisplacement = {column = "D", unit = "cm"}\nvelocity = {column = "V", unit = "cm/s"}\n'
        'force = {column = "F", unit = "N"}\ncurrent = {column = "Y", unit = "A"}\n',
        pieces=8,
    ),
    "keio": RealSet(
        ("mr_damper_sano_keio/Magneto.mat",),
        'dt = 0.005\n[channels]\nvelocity = {column = ["U", "U_val"], unit = "cm/s"}\n'
        'force = {column = ["Y", "Y_val"], scale = -1.0, unit = "N"}\n',
        pieces=3,
        current=lambda stem: 1.25,
        position=False,
    ),
}
LOGGED = ("displacement", "velocity", "force", "current")
SHARES = (0.03, 0.06, 0.12)
# the field's dead time that stands for a lag in records with a varying current, by share (s)
EARLIER = {0.03: 0.004, 0.06: 0.008, 0.12: 0.016}
OF_POSITION = ("gas-spring", "end-stop")
# the first five count, the others are reported
PLANTS = ("gas-spring", "inertia", "asymmetry", "gain-drift", "current-lag", "end-stop", "temperature")
REAL_BASES = {"development": ("bingham", "tanh", "boucwen"), "evaluation": ("biviscous", "guo", "spencer")}


def available() -> bool:
    """Return whether the folder of real logs is named."""
    return "MRFIT_REAL_LOGS" in os.environ


@cache
def load(name: str) -> tuple[tuple[dict[str, Array], ...], tuple[float, ...], tuple[dict[str, float], ...]]:
    """Return channels, sample intervals and conditions of a set's records, as mrfit reads them, cut into pieces."""
    chosen, root = SETS[name], Path(os.environ["MRFIT_REAL_LOGS"])
    with TemporaryDirectory() as folder:
        map_file = Path(folder) / "map.toml"
        map_file.write_text(chosen.channel_map, encoding="utf-8")
        read = mrfit.read([str(root / f) for f in chosen.files], map=map_file)
    channels, dts, conditions = [], [], []
    for log in read:
        length = _moving(log.channels) // chosen.pieces
        known = {k: v for k, v in log.condition.items() if k == "current"}
        if chosen.current is not None:
            known["current"] = chosen.current(Path(log.source).stem)
        for k in range(chosen.pieces):
            cut = slice(k * length, (k + 1) * length)
            channels.append({n: np.array(v[cut]) for n, v in log.channels.items() if n in LOGGED})
            dts.append(log.dt)
            conditions.append(known)
    return tuple(channels), tuple(dts), tuple(conditions)


def _moving(channels: Mapping[str, Array]) -> int:
    """Return how many samples a record has until its motion ends."""
    motion = channels["displacement"] if "displacement" in channels else channels["velocity"]
    away = np.abs(motion - np.median(motion))
    return int(np.flatnonzero(away > 0.1 * away.max())[-1]) + 1


def cases(split: str, group: str, bases: tuple[str, ...]) -> list[Case]:
    """Return the cases on real records: as they are, and with planted effects."""
    made = []
    for records, chosen in SETS.items():
        varies = records == "nees"
        for base in bases:
            title = f"{split}-{group}-{records}"
            if group == "real":
                made.append(Case(f"{title}-{base}", split, group, base, records=records))
                continue
            for plant in PLANTS:
                owned = plant == "gas-spring" and base in OWN_SPRING
                if owned or (plant in OF_POSITION and not chosen.position) or (plant == "current-lag" and not varies):
                    continue
                for share in SHARES:
                    word = f"{title}-{plant}-{round(100 * share)}"
                    seed = crc32(word.encode())
                    made.append(
                        Case(f"{word}-{base}", split, group, base, (plant,), seed=seed, records=records, share=share)
                    )
    return made


def asked_of(case: Case) -> tuple[Asked, dict[str, dict]]:
    """Return a set of real records, with the case's effect planted, and the truth about it."""
    channels, dts, conditions = load(case.records)
    asked = Asked(channels, dts, case.base, conditions)
    if not case.hidden:
        return asked, {}
    return _planted(asked, case.hidden[0], case.share, np.random.default_rng([case.seed, 0]))


def motion_of(channels: dict[str, Array], dt: float) -> tuple[Array, Array, Array]:
    """Return displacement (or none: zeros), velocity and acceleration, smoothed over a part of the fastest period."""
    given = channels.get("displacement")
    x = np.cumsum(channels["velocity"]) * dt if given is None else given
    power = np.abs(np.fft.rfft(np.diff(x))) ** 2
    top = np.fft.rfftfreq(len(x) - 1, dt)[np.searchsorted(np.cumsum(power), 0.95 * power.sum())]
    width = int(np.clip(round(0.1 / top / dt), 5, len(x) // 8)) | 1
    v, a = (np.asarray(savgol_filter(x, width, 3, deriv=d, delta=dt)) for d in (1, 2))
    return x, v, a


def _planted(asked: Asked, name: str, share: float, rng: np.random.Generator) -> tuple[Asked, dict[str, dict]]:
    if name == "current-lag":
        return _earlier(asked, EARLIER[share])
    moved = [motion_of(c, dt) for c, dt in zip(asked.channels, asked.dt, strict=True)]
    force = [c["force"] for c in asked.channels]
    span = max(map(np.max, force)) - min(map(np.min, force))
    unit, extra = _unit(name, asked, moved, rng)
    # the force of a unit: linear but for the temperature, whose factor bends little
    strength = float(share * span / max(np.abs(u).max() for u in unit))
    made = list(np.add(f, strength * u) for f, u in zip(force, unit, strict=True))
    if name == "temperature":
        made = [f * np.exp(-strength * e["temperature"]) for f, e in zip(force, extra, strict=True)]
        extra = [{"temperature": e["temperature"] + 35.0} for e in extra]
    channels = [{**c, "force": f, **e} for c, f, e in zip(asked.channels, made, extra, strict=True)]
    value = {
        "gas-spring": {"k_g": strength},
        "inertia": {"m": strength},
        "asymmetry": {"g_yield": 2 * strength / (1 - strength)},
        "gain-drift": {"g": strength},
        "end-stop": {"peak": float(share * span)},
        "temperature": {"b_yield": strength},
    }[name]
    return replace(asked, channels=channels), {name: {"values": value, "size": share}}


def _unit(
    name: str, asked: Asked, moved: list[tuple[Array, Array, Array]], rng: np.random.Generator
) -> tuple[list[Array], list[dict[str, Array]]]:
    """Return the force that an effect of strength 1 adds to each record, and channels that are logged with it."""
    force = [c["force"] for c in asked.channels]
    extra: list[dict[str, Array]] = [{} for _ in force]
    longest = max((m[0] for m in moved), key=np.ptp)
    middle, half = (longest.max() + longest.min()) / 2, np.ptp(longest) / 2
    if name == "gas-spring":
        return [x - middle for x, _, _ in moved], extra
    if name == "inertia":
        return [a for _, _, a in moved], extra
    if name == "end-stop":
        met = rng.uniform(0.6, 0.85) * half
        return [np.sign(x - middle) * np.maximum(np.abs(x - middle) - met, 0) for x, _, _ in moved], extra
    if name == "asymmetry":
        speed = 0.03 * max(np.percentile(np.abs(v), 99) for _, v, _ in moved)
        return [(f - _level(f)) * np.tanh(v / speed) for f, (_, v, _) in zip(force, moved, strict=True)], extra
    if name == "gain-drift":
        return [f * np.arange(len(f)) * dt for f, dt in zip(force, asked.dt, strict=True)], extra
    for k, f in enumerate(force):
        warm = rng.uniform(-15, 5) + rng.uniform(2, 10) * np.linspace(0, 1, len(f))
        extra[k] = {"temperature": warm}
    return [-f * e["temperature"] for f, e in zip(force, extra, strict=True)], extra


def _level(force: Array) -> float:
    """Return the middle of a force: a load cell's offset is no part of the law."""
    return float(force.max() + force.min()) / 2


def _earlier(asked: Asked, seconds: float) -> tuple[Asked, dict[str, dict]]:
    channels = []
    for c, dt in zip(asked.channels, asked.dt, strict=True):
        n = round(seconds / dt)
        current = np.concatenate([c["current"][n:], np.full(n, c["current"][-1])])
        channels.append({k: v[: len(v) - n] for k, v in {**c, "current": current}.items()})
    return replace(asked, channels=channels), {"current-lag": {"values": {"t_d": seconds}, "size": 0.0}}
