"""A Tektronix MSO oscilloscope in high-resolution mode: probe offset, noise, 12-bit converter, and its CSV file."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from datasets.rig.stop import Array

LEVELS_PER_DIVISION = 400
DIVISIONS = 4.0
HEADER = """\
Model,MSO3014
Firmware Version,2.40

Waveform Type,ANALOG,
Point Format,Y,
Horizontal Units,s,
Horizontal Scale,{horizontal:g},
Horizontal Delay,0,
Sample Interval,{interval:g},
Record Length,{length},
Gating,0.0% to 100.0%,
Probe Attenuation,1,
Vertical Units,V,
Vertical Offset,0,
Vertical Scale,{vertical:g},
Vertical Position,0,
{blank}
{blank}
{blank}
Label{blank}
TIME,{names}
"""


@dataclass(frozen=True, slots=True)
class Probe:
    """What stands between the physical signal and the converter, in volts at the scope's input."""

    gain: float
    offset: float


def vertical_scale(peak: float) -> float:
    """Return the smallest 1-2-5 volts per division that keeps ``peak`` within four divisions."""
    scales = [m * 10.0**e for e in range(-3, 3) for m in (1, 2, 5)]
    return next(s for s in scales if peak <= DIVISIONS * s)


def acquire(signal: Array, probe: Probe, noise: Array) -> tuple[Array, float]:
    """Return what the scope stores of a physical signal (N,) under noise (N,) in V, and its volts per division."""
    clean = probe.gain * signal + probe.offset
    scale = vertical_scale(float(np.abs(clean).max()))
    level = scale / LEVELS_PER_DIVISION
    codes = np.clip(np.rint((clean + noise) / level), -2048, 2047)
    return codes * level, scale


def write(path: Path, start: float, interval: float, channels: dict[str, Array], vertical: float) -> None:
    """Write the CSV file a Tektronix MSO3000 saves: 21 header lines, then time in five digits and one column each."""
    columns = [column + 0.0 for column in channels.values()]
    length = len(columns[0])
    head = HEADER.format(
        horizontal=length * interval / 10,
        interval=interval,
        length=length,
        vertical=vertical,
        blank="," * len(columns),
        names=",".join(channels),
    )
    times = start + interval * np.arange(length)
    rows = (f"{t:.4e}," + ",".join(f"{v:.6g}" for v in row) + "\n" for t, *row in zip(times, *columns, strict=True))
    with path.open("w", newline="\n", encoding="ascii") as file:
        file.write(head)
        file.writelines(rows)
