"""The motion at which a damper is to give a force: a sine, or a log's, smoothed as a fit smooths it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import mrfit.segment.stage
from mrfit.core import recording as core
from mrfit.core.arguments import check_arguments
from mrfit.core.channels import MOTION
from mrfit.core.progress import silent
from mrfit.core.specs import Array
from mrfit.errors import ConfigError, DataError
from mrfit.segment.stage import cut
from mrfit.settings.forms import number
from mrfit.signal.smoothing import smooth

_LONGEST = 200_000
"""Samples of a motion; a simulation takes each by itself."""


@dataclass(frozen=True)
class Motion:
    """Channels (N,) of a damper's motion, SI, every ``dt`` s; ``force`` as measured, where there is one."""

    name: str
    dt: float
    channels: Mapping[str, Array]
    force: Array | None = None

    @property
    def samples(self) -> int:
        """Number of samples."""
        return len(next(iter(self.channels.values())))

    @property
    def time(self) -> Array:
        """Times in s from the first sample."""
        return np.arange(self.samples, dtype=np.float64) * np.float64(self.dt)


@check_arguments
def sine(frequency: float, amplitude: float, cycles: float = 4.0, dt: float = 1e-3, output: str = "force") -> Motion:
    """Return a sine of a frequency in Hz and an amplitude in m (rad for a torque).

    Raises
    ------
    ConfigError
        If a number is not positive, or there are fewer than 20 samples a cycle.
    """
    if output not in MOTION:
        raise ConfigError(f"a sine is for a {' or a '.join(MOTION)}, not for '{output}'")
    if not min(frequency, amplitude, cycles, dt) > 0.0:
        raise ConfigError("a sine needs a frequency, an amplitude, cycles and a sample interval above 0")
    phase, omega = sine_phase(frequency, cycles, dt), 2.0 * np.pi * frequency
    courses = (np.sin(phase), omega * np.cos(phase), -(omega**2) * np.sin(phase))
    channels = {n: amplitude * c for n, c in zip(MOTION[output], courses, strict=True)}
    return Motion(f"sine {frequency:g} Hz, {amplitude:g} {'m' if output == 'force' else 'rad'}", dt, channels)


def sine_phase(frequency: float, cycles: float, dt: float) -> Array:
    """Return the phase in rad of every sample of a sine of some cycles, (N,).

    Raises
    ------
    ConfigError
        If there are fewer than 20 samples a cycle, or too many of them.
    """
    count = int(np.ceil(cycles / frequency / dt)) + 1
    if frequency * dt > 0.05 or count > _LONGEST:
        raise ConfigError(
            f"a sine of {frequency:g} Hz for {cycles:g} cycles cannot be sampled every {dt:g} s (--dt): "
            f"take 20 samples a cycle or more, {_LONGEST} at most"
        )
    return np.asarray(2.0 * np.pi * frequency * np.arange(count) * dt, dtype=np.float64)


def written_sine(text: str, unit: str) -> tuple[float, float, float]:
    """Return frequency in Hz, amplitude and cycles of a sine ``HZ:UNIT`` or ``HZ:UNIT:CYCLES``.

    Raises
    ------
    ConfigError
        If it is malformed, or a number is not positive.
    """
    numbers = [number("--sine", part) for part in text.split(":")]
    if len(numbers) not in (2, 3) or not min(numbers) > 0.0:
        raise ConfigError(f"--sine takes HZ:{unit} or HZ:{unit}:CYCLES above 0, not '{text}'")
    frequency, amplitude, cycles = numbers if len(numbers) == 3 else (*numbers, 4.0)
    return frequency, amplitude, cycles


def check_length(log: str, samples: int) -> None:
    """Raise a DataError if a log is longer than what is simulated at once."""
    if samples > _LONGEST:
        raise DataError(f"{log}: more than {_LONGEST} samples; cut the log")


def of_recordings(recordings: Iterable[core.Recording], names: Iterable[str], output: str) -> list[Motion]:
    """Return the motions of logs, one of each, smoothed and differentiated as before a fit.

    Parameters
    ----------
    recordings
        The logs.
    names
        Channels that the damper needs, the current excepted.
    output
        What it gives, ``force`` or ``torque``; a log's own is kept beside the motion.

    Raises
    ------
    DataError
        If a log lacks a channel, or is too long.
    """
    found = []
    wanted = list(dict.fromkeys((*MOTION[output], *(n for n in names if n not in ("current", "time")))))
    for recording in recordings:
        whole = replace(moving_stretch(recording), warm_up=0)
        check_length(recording.source or recording.id, whole.samples)
        drive = smooth(recording, whole, wanted)
        measured = recording.channels.get(output)
        channels = dict(zip(wanted, drive.values, strict=True))
        force = None if measured is None else measured[whole.start : whole.stop]
        found.append(Motion(recording.id, drive.dt, channels, force))
    return found


def moving_stretch(recording: core.Recording) -> core.Segment:
    """Return the first stretch of motion of a log.

    Raises
    ------
    DataError
        If there is none.
    """
    segments, _ = cut([recording], 1, mrfit.segment.stage.Settings(holdout="none"), silent)
    if not segments:
        raise DataError(f"{recording.source or recording.id}: no stretch of motion was found in it")
    return segments[0]


def desired_series(recordings: Iterable[core.Recording], motion: Motion, output: str) -> Array:
    """Return the desired forces of a file at a motion's samples, linear between the file's.

    Raises
    ------
    DataError
        If there is not one log with the output's channel, or it is shorter than the motion.
    """
    logs = list(recordings)
    source = Path(logs[0].source).name if logs else "the file"
    if len(logs) != 1 or output not in logs[0].channels:
        raise DataError(f"{source}: needs a column '{output}' beside the time, in one stretch without gaps")
    times = np.arange(logs[0].samples) * logs[0].dt
    if times[-1] < motion.time[-1] - 0.5 * motion.dt:
        raise DataError(
            f"{source}: ends after {times[-1]:g} s, the motion after {motion.time[-1]:g} s; give a force for all of it"
        )
    return np.interp(motion.time, times, logs[0].channels[output])
