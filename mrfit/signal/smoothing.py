"""The one smoother and differentiator: what drives a model, freed of noise.

Every wiggle of a noisy input is a reversal to a rate-independent model, and biases its hysteresis at an error that
looks perfect. Periodic channels are replaced by their Fourier series, those whose cycles differ a little by a series
with slowly moving amplitude and timing (``modulation``), others by local polynomials (``savitzky_golay``) that end at
corners; derivatives come from the same series or the same polynomials.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrfit.core.channels import ANTIDERIVATIVES, CONTROL, DRIVING_MOTIONS, EXCITATIONS, FAST_INPUTS, LEVEL_CHANNELS
from mrfit.core.counting import number_of
from mrfit.core.recording import FLUX_RESISTANCE, HEAT_BEFORE, Recording, Segment
from mrfit.core.remembered import remembered
from mrfit.core.specs import Array, Mask
from mrfit.errors import DataError
from mrfit.io.columns import COLUMN_CHUNK
from mrfit.kernels.windows import moving_mean
from mrfit.signal.harmonics import HarmonicFit, harmonic_fit
from mrfit.signal.modulation import ModulatedSeries, modulated_series, modulation
from mrfit.signal.noise import noise_floor, noise_level
from mrfit.signal.plateaus import at_levels
from mrfit.signal.savitzky_golay import POLYNOMIAL_ORDER, WINDOW_MIN, Smoother

# A series is taken where its residual is noise: at most this much above the channel's own white noise …
WHITE_EXCESS = 1.3
# … or above what does not repeat between cycles, if that is at most the given share of the signal's amplitude.
REPEAT_LIMITS = ((1.1, 0.02), (1.5, 0.01))
FITTED_CYCLES = 4
# Share of the range by which cycles of an exact command differ
SERIES_RESOLUTION = 1e-5
# A series of fewer harmonics than this has no corners
RINGING = 3
# Share of a channel's slope below which what a series lacks of it is too little to matter
LEAST_RINGING = 0.02
# A channel rests where its slope is no larger, in more than this share of its samples; a sine never does
LEAST_RESTING = 0.05
# What a series leaves is a drift of the sensor where the means of its cycles hold more than this share of its square
DRIFT_OF_SERIES = 0.25
# Chance by which noise may pass for cycles that differ; where a modulated series leaves white noise of a residual that
# was many times that, coloured noise it cannot be
REPEAT_CHANCE, CHANCE_IF_WHITE, SERIES_EXCESS = 1e-4, 0.05, 2.0
# A modulated series is taken where it leaves no more than this above the channel's own white noise
MODULATED_EXCESS = 1.1

# Swings of an excitation, whole cycles of it, that lead into a steady state
LEAD_SWINGS = 60

# Seconds from the record's first sample: what does not repeat with the drive depends on it
TIME_CHANNEL = "time"


@dataclass(frozen=True, slots=True)
class Drive:
    """Smoothed inputs of a model over a segment and its warm-up.

    Attributes
    ----------
    values
        Channels (C, N) in the order asked for; column ``warm_up`` is the segment's first sample.
    warm_up
        Samples before the segment.
    dt
        Sample interval in s.
    method
        How each channel was smoothed, for people.
    noise
        Channel name -> rms of what was taken away, in the channel's unit.
    fits
        One Fourier series for every channel, with t = 0 at the first column, or None unless all channels are periodic.
    entry
        Part of a cycle before the segment at which a simulation of the series begins, beside whole cycles.
    """

    values: Array
    warm_up: int
    dt: float
    method: str
    noise: dict[str, float]
    fits: tuple[HarmonicFit, ...] | None
    entry: float = 0.0

    def without_values(self) -> "Drive":
        """Return the drive of a periodic segment as its series alone."""
        return replace(self, values=self.values[:, :0].copy())


@dataclass(frozen=True, slots=True)
class _SmoothedChannel:
    values: Array
    method: str
    noise: float
    fit: HarmonicFit | None


def smooth(recording: Recording, segment: Segment, names: Sequence[str]) -> Drive:
    """Return the smoothed inputs of a model over ``[segment.start − segment.warm_up, segment.stop)``.

    A channel of a periodic segment becomes its Fourier series if what that leaves is noise, a modulated series if
    cycles differ by more than noise and that follows them, any other a local polynomial. Velocities and accelerations
    that were not recorded are derivatives of the recorded stroke or angle; a current or a temperature that was not
    recorded is constant at the level that the segment or the condition gives.

    Parameters
    ----------
    recording
        Log the segment points into.
    segment
        Range and fundamental frequency.
    names
        Channels wanted.

    Raises
    ------
    DataError
        If a channel is neither recorded nor derivable.
    """
    if names and names[0] in EXCITATIONS.values():
        return _excited(recording, segment, names)
    begin = max(segment.start - segment.warm_up, 0)
    sources = {name: _source(recording, segment, name) for name in names if name != TIME_CHANNEL}
    frequency = _frequency(recording, segment, begin)
    smoothed: dict[tuple[str, int], _SmoothedChannel] = {}
    smoothers: dict[str, HarmonicFit | ModulatedSeries | Smoother] = {}
    for source, derivative in sources.values():
        if isinstance(source, str) and (source, derivative) not in smoothed:
            window = recording.channels[source][begin : segment.stop]
            if source not in smoothers:
                found = _series(window, segment, recording.dt, frequency)
                smoothers[source] = _smoother(window, segment, recording.dt, found, source in DRIVING_MOTIONS)
            smoothed[source, derivative] = _smoothed(window, recording.dt, smoothers[source], derivative)
            if source in LEVEL_CHANNELS and isinstance(smoothers[source], Smoother):
                smoothed[source, derivative] = _held(window, smoothed[source, derivative])
    count = segment.stop - begin
    channels = {
        name: smoothed[source, derivative] if isinstance(source, str) else _level(source, count)
        for name, (source, derivative) in sources.items()
    }
    if TIME_CHANNEL in names:
        elapsed = np.arange(begin, segment.stop, dtype=np.float64) * recording.dt
        channels[TIME_CHANNEL] = _SmoothedChannel(elapsed, "as recorded", 0.0, None)
    fits = [c.fit for c in channels.values() if c.fit is not None]
    return Drive(
        values=np.stack([channels[n].values for n in names]),
        warm_up=segment.start - begin,
        dt=recording.dt,
        method=_method(channels, sources),
        noise={n: c.noise for n, c in channels.items()},
        fits=tuple(fits) if len(fits) == len(names) and frequency > 0.0 else None,
    )


def from_the_beginning(drive: Drive, recording: Recording, segment: Segment, names: Sequence[str]) -> Drive:
    """Return a smoothed drive of a segment led in by all that was recorded before, with no series to extend it by.

    Parameters
    ----------
    drive
        What ``smooth`` gives.
    recording, segment, names
        What it was made of.
    """
    before = segment.start - drive.warm_up
    if before > 0:
        whole = replace(segment, start=0, stop=recording.samples, warm_up=0, frequency=0.0, cycles=0)
        lead = smooth(recording, whole, names).values[:, :before]
        drive = replace(drive, values=np.hstack([lead, drive.values]), warm_up=segment.start)
    return replace(drive, fits=None)


def _excited(recording: Recording, segment: Segment, names: Sequence[str]) -> Drive:
    """Return an excitation as recorded; of one in its steady state one cycle, behind cycles that lead into it."""
    source, others = _source(recording, segment, names[0])[0], names[1:]
    values = np.asarray(recording.channels[str(source)])
    begin, stop = max(segment.start - segment.warm_up, 0), segment.stop
    if segment.cycles:
        period = segment.samples // segment.cycles
        cycle = values[segment.start : segment.start + period]
        swings = max(np.count_nonzero(np.diff(np.signbit(cycle - cycle.mean()))) / 2, 0.5)
        begin = segment.start - math.ceil(LEAD_SWINGS / swings) * period
        stop = segment.start + period
    place = np.arange(begin, stop) % len(values)
    rows = [values]
    if others:
        whole = replace(segment, start=0, stop=recording.samples, warm_up=0, cycles=0)
        rows += [*smooth(recording, whole, others).values]
    drive = np.stack([row[place] for row in rows])
    text = f"{names[0]} as recorded, a windowed sinc between samples" + ", in its steady state" * bool(segment.cycles)
    return Drive(drive, segment.start - begin, recording.dt, text, dict.fromkeys(names, 0.0), None)


def check_inputs(recording: Recording, segment: Segment, names: Sequence[str]) -> None:
    """Raise the DataError with which ``smooth`` would refuse a segment that lacks a channel."""
    for name in names:
        if name != TIME_CHANNEL:
            _source(recording, segment, name)


def inputs_repeat(recording: Recording, segment: Segment) -> bool:
    """Return whether every input recorded repeats with the cycle of a segment: its series leaves only noise."""
    windows, frequency = _fast_windows(recording, segment)
    found = (_series(window, segment, recording.dt, frequency) for window in windows)
    return all(isinstance(series, HarmonicFit) for series in found)


def cycles_agree(recording: Recording, segment: Segment) -> bool:
    """Return whether the cycles of every input recorded differ by no more than white noise, whatever their shape.

    A corner takes more harmonics than a series has, and few cycles of a sweep seem to repeat.
    """
    windows, frequency = _fast_windows(recording, segment)
    skipped = _unsettled(segment, len(windows[0])) if windows else 0
    return bool(windows) and all(_agree(w[skipped:], segment.cycles, recording.dt, frequency) for w in windows)


def _agree(values: Array, cycles: int, dt: float, frequency: float) -> bool:
    if frequency <= 0.0 or cycles < 2:
        return False
    limit = max(WHITE_EXCESS * noise_level(values), SERIES_RESOLUTION * float(np.ptp(values)))
    return noise_floor(values, dt, frequency, cycles) <= limit


def _fast_windows(recording: Recording, segment: Segment) -> tuple[list[Array], float]:
    """Return the recorded inputs that change within a cycle, from the lead-in on, and the fundamental in Hz."""
    begin = max(segment.start - segment.warm_up, 0)
    windows = [recording.channels[n][begin : segment.stop] for n in FAST_INPUTS if n in recording.channels]
    return windows, _frequency(recording, segment, begin) if windows else 0.0


def _source(recording: Recording, segment: Segment, name: str) -> tuple[str | float, int]:
    """Return the recorded channel and the order of derivative that give ``name``, or its constant level."""
    if name in recording.channels:
        return name, 0
    for source, derivative in ANTIDERIVATIVES.get(name, ()):
        if source in recording.channels:
            return source, derivative
    if name in LEVEL_CHANNELS:
        level = float(getattr(segment, name))
        level = level if np.isfinite(level) else float(recording.condition.get(name, np.nan))
        if np.isfinite(level):
            return level, 0
    if name == FLUX_RESISTANCE:
        return float(recording.condition.get(name, 0.0)), 0
    if name == HEAT_BEFORE and CONTROL in recording.channels:
        return _heat_before(recording, segment), 0
    raise DataError(f"{recording.source}: no {name} in this log; {_remedy(name)}")


def _heat_before(recording: Recording, segment: Segment) -> float:
    current, begin = recording.channels[CONTROL], max(segment.start - segment.warm_up, 0)
    # of a recording on disk no more than a chunk is read at a time
    starts = range(0, begin, COLUMN_CHUNK)
    before = sum(_square_sum(current[k : min(k + COLUMN_CHUNK, begin)]) for k in starts)
    rate = _square_sum(current[begin : segment.stop]) / (segment.stop - begin)
    return (before - rate * begin) * recording.dt


def _square_sum(values: Array) -> float:
    return float(np.vdot(values, values))


def _remedy(name: str) -> str:
    column = f"name its column in the channel map ([channels] {name} = {{column = …, unit = …}})"
    if name in LEVEL_CHANNELS:
        return f"{column}, or give its level in [condition] or in the file's name"
    if name in ANTIDERIVATIVES:
        stroke = ANTIDERIVATIVES[name][-1][0]
        return f"{column}, or that of {stroke}, from which it is derived"
    return f"{column}, or choose a model without it (`mrfit list models`)"


def _frequency(recording: Recording, segment: Segment, begin: int) -> float:
    """Return the fundamental refined on the segment's drive, 0 for a segment without one."""
    if segment.cycles < 1 or segment.frequency <= 0.0 or segment.drive not in recording.channels:
        return segment.frequency if segment.cycles else 0.0
    values = recording.channels[segment.drive][begin : segment.stop]
    return harmonic_fit(values[_unsettled(segment, len(values)) :], recording.dt, segment.frequency).frequency


def _unsettled(segment: Segment, samples: int) -> int:
    """Return how many samples to leave out of a series: the lead-in, still settling, where enough cycles follow it."""
    return samples - segment.samples if segment.cycles >= FITTED_CYCLES else 0


def _series(values: Array, segment: Segment, dt: float, frequency: float) -> HarmonicFit | ModulatedSeries | None:
    """Return the Fourier series of a channel from its first sample on, modulated where its cycles do not repeat.

    None where either leaves more than noise.
    """
    if frequency <= 0.0:
        return None
    skipped = _unsettled(segment, len(values))
    settled, fit = _without_drift(values[skipped:], dt, frequency)
    chance = modulation(settled, fit, dt)
    if chance < CHANCE_IF_WHITE:
        series, white = modulated_series(settled, fit, dt, skipped), noise_level(values)
        follows = series.residual <= MODULATED_EXCESS * white
        if chance < REPEAT_CHANCE or (follows and fit.residual > SERIES_EXCESS * white):
            return series if follows else None
    return fit.shifted(-skipped * dt) if _leaves_noise(fit, settled, dt) else None


def _without_drift(values: Array, dt: float, frequency: float) -> tuple[Array, HarmonicFit]:
    """Return a channel (N,) and its series, without the sensor's slow drift where that is most of what a series leaves.

    Beside a drift a series has fewer harmonics than noise alone would leave it, and rounds the corners of a stroke.
    The drift is a line between the means of neighbouring cycles.
    """
    fit = replace(harmonic_fit(values, dt, frequency, refine=False), frequency=frequency)
    period = 1.0 / (frequency * dt)
    cycles = int(len(values) / period)
    if cycles < FITTED_CYCLES:
        return values, fit
    rest = values - fit.sampled(0.0, dt, len(values))
    edges = np.rint(period * np.arange(cycles + 1)).astype(int)
    means = np.add.reduceat(rest[: edges[-1]], edges[:-1]) / np.diff(edges)
    # the first and the last half cycle go on as the line before them does
    places = np.concatenate([[-0.5], np.arange(cycles) + 0.5, [cycles + 0.5]])
    ends = 2 * means[0] - means[1], 2 * means[-1] - means[-2]
    drift = np.interp(np.arange(len(values)) / period, places, np.concatenate([ends[:1], means, ends[1:]]))
    size, limit = float(np.sqrt(np.mean(drift**2))), REPEAT_LIMITS[0][1] * float(np.ptp(values)) / 2
    if not DRIFT_OF_SERIES * np.mean(rest**2) < size**2 <= limit**2:
        return values, fit
    settled = values - drift
    return settled, replace(harmonic_fit(settled, dt, frequency, refine=False), frequency=frequency)


def _smoother(
    values: Array, segment: Segment, dt: float, series: HarmonicFit | ModulatedSeries | None, moves: bool
) -> HarmonicFit | ModulatedSeries | Smoother:
    """Return a channel's series, or local polynomials where there is none or where it rings.

    At corners a series rings within the noise, but its slope rings beyond. Where local polynomials that end at the
    corners come closer to the samples, beside the corners and overall, the corners are sharp and all of them known.
    """
    if series is None and len(values) < WINDOW_MIN:
        raise DataError(f"segment {segment.id} has {len(values)} samples, too few to smooth; use a longer log")
    if isinstance(series, HarmonicFit) and series.harmonics < RINGING:
        return series
    local = _local(values, moves)
    if series is None or (isinstance(series, HarmonicFit) and _lacks_harmonics(values, dt, series, local)):
        return local
    near = local.near_corners()
    if not near.any():
        return series
    if isinstance(series, HarmonicFit):
        by_series = series.sampled(0.0, dt, len(values))
    else:
        by_series = series.derivatives[0]
    left = np.stack([(values - found) ** 2 for found in (by_series, local.smoothed(0).values)])
    nearer = all(part[1] < part[0] for part in (left[:, near].sum(axis=1), left.sum(axis=1)))
    return local if nearer else series


def _lacks_harmonics(values: Array, dt: float, series: HarmonicFit, local: Smoother) -> bool:
    """Return whether a series rings in its slope, where local polynomials leave no more than white noise.

    Beside noise of low frequencies a series has fewer harmonics than the corners of a stroke need, and rings there. In
    the difference of both slopes the error of the series repeats, and what polynomials follow of the noise does not.
    Where the channel rests, all that is more than the error of the polynomials matters: a friction turns with it.
    Polynomials that leave more than white noise are no judge: they round what they should follow.
    """
    limit = WHITE_EXCESS * noise_level(values)
    if series.residual <= limit or local.residual > limit or _whole_cycles(series, dt, len(values)) < 2:
        return False
    found, rates = local.smoothed(1), series.derivative(1).sampled(0.0, dt, len(values))
    slope, little = found.values / dt, LEAST_RINGING**2 * float(np.var(rates))
    if _repeats(slope - rates, series, dt, little):
        return True
    resting = slope**2 < little
    if np.mean(resting) < LEAST_RESTING:
        return False
    # a drift of the sensor, which polynomials follow and a series does not, is no ringing
    apart = slope - rates - _means_over_a_cycle(slope - rates, resting, series.frequency * dt)
    by_chance = float(np.mean(np.where(resting, found.variance, 0.0))) / dt**2
    return _repeats(np.where(resting, apart, 0.0), series, dt, by_chance)


def _repeats(error: Array, series: HarmonicFit, dt: float, limit: float) -> bool:
    """Return whether an error (N,) repeats with the cycle of a series, and has more power than a limit."""
    other = noise_floor(error, dt, series.frequency, _whole_cycles(series, dt, len(error)))
    return float(np.mean(error**2)) > max(2.0 * other**2, limit)


def _means_over_a_cycle(values: Array, counted: Mask, frequency: float) -> Array:
    """Return the means (N,) of the values that count within a cycle, of a frequency per sample, about each sample."""
    whole, half = (np.array([0]), np.array([len(values)])), round(0.5 / frequency)
    sums, counts = (moving_mean(np.where(counted, v, 0.0), *whole, half) for v in (values, np.ones(len(values))))
    means: Array = sums / np.maximum(counts, 1.0 / len(values))
    return means


@remembered
def _local(values: Array, moves: bool) -> Smoother:
    return Smoother(values, moves=moves)


def _smoothed(
    values: Array, dt: float, smoother: HarmonicFit | ModulatedSeries | Smoother, derivative: int
) -> _SmoothedChannel:
    if isinstance(smoother, HarmonicFit):
        text = f"harmonic fit, {number_of('harmonic', smoother.harmonics)} of {smoother.frequency:.5g} Hz"
        rates = smoother.derivative(derivative)
        return _SmoothedChannel(rates.sampled(0.0, dt, len(values)), text, smoother.residual, rates)
    if isinstance(smoother, ModulatedSeries):
        text = f"modulated harmonic fit, amplitude and timing differ by {100 * smoother.depth:.2g} %"
        return _SmoothedChannel(smoother.derivatives[derivative], text, smoother.residual, None)
    found = smoother.smoothed(derivative)
    text = "as recorded"
    if found.widest > 1:
        windows = f"{found.window}" if found.widest <= found.window else f"{found.window} to {found.widest}"
        text = f"savitzky-golay, window {windows} samples, order {POLYNOMIAL_ORDER}"
        text += f", {number_of('corner', smoother.corners)} kept" if smoother.corners else ""
    return _SmoothedChannel(found.values / dt**derivative, text, smoother.residual, None)


def _held(values: Array, channel: _SmoothedChannel) -> _SmoothedChannel:
    levels = at_levels(values, channel.values, noise_level(values))
    held = int(np.sum(levels != channel.values))
    text = f"{channel.method}; held levels at their means" if held else channel.method
    return replace(channel, values=levels, method=text)


def _whole_cycles(series: HarmonicFit, dt: float, samples: int) -> int:
    return int(samples * dt * series.frequency + 0.02)


def _leaves_noise(fit: HarmonicFit, values: Array, dt: float) -> bool:
    """Tell whether a series leaves nothing but noise: white, or any that does not repeat from cycle to cycle."""
    span = float(np.ptp(values))
    if fit.residual <= max(WHITE_EXCESS * noise_level(values), 1e-6 * span):
        return True
    limits = [excess for excess, share in REPEAT_LIMITS if fit.residual <= share * span / 2]
    if not limits:
        return False
    cycles = _whole_cycles(fit, dt, len(values))
    return bool(fit.residual <= max(limits) * noise_floor(values, dt, fit.frequency, cycles))


def _level(level: float, count: int) -> _SmoothedChannel:
    return _SmoothedChannel(np.full(count, level), "constant", 0.0, HarmonicFit(1.0, np.array([level + 0j]), 0.0))


def _method(channels: Mapping[str, _SmoothedChannel], sources: Mapping[str, tuple[str | float, int]]) -> str:
    texts = {}
    for name, channel in channels.items():
        source, derivative = sources.get(name, (name, 0))
        texts[name] = f"{channel.method} of {source}" if derivative else channel.method
    if len(set(texts.values())) == 1:
        return next(iter(texts.values()))
    return "; ".join(f"{name}: {text}" for name, text in texts.items())
