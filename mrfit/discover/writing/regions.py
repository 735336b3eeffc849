"""Places of the error, in regions a person knows: share of the squared error against share of the samples."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrfit.core.channels import CONTROL, MOTION, unit_of
from mrfit.core.specs import Array, Mask
from mrfit.discover.evidence.bench import Bench, Stretch
from mrfit.discover.evidence.refit import Refit, usual
from mrfit.discover.policy import STANDARD, Policy


@dataclass(frozen=True)
class Region:
    """A part of the samples and what part of the squared error it holds.

    Attributes
    ----------
    name
        In words.
    share_of_error, share_of_samples
        Between 0 and 1.
    """

    name: str
    share_of_error: float
    share_of_samples: float

    @property
    def excess(self) -> float:
        """Share of the error beyond that of the samples."""
        return self.share_of_error - self.share_of_samples


def locate(bench: Bench, errors: Sequence[Array], stretches: Sequence[Stretch]) -> list[Region]:
    """Return the regions, the one with the largest excess of error first.

    Parameters
    ----------
    bench
        The data: ranges of channels are taken over all of it.
    errors
        For each segment the errors (N_s,), in one unit.
    stretches
        The segments.
    """
    power: dict[str, float] = {}
    samples: dict[str, int] = {}
    for error, stretch in zip(errors, stretches, strict=True):
        for name, mask in _masks(bench, stretch).items():
            power[name] = power.get(name, 0.0) + float(np.sum(error[mask] ** 2))
            samples[name] = samples.get(name, 0) + int(mask.sum())
    total_power = sum(float(e @ e) for e in errors)
    total = sum(len(e) for e in errors)
    regions = [
        Region(n, power[n] / max(total_power, 1e-300), samples[n] / total) for n in power if 0 < samples[n] < total
    ]
    return sorted(regions, key=lambda r: -r.excess)


def _masks(bench: Bench, stretch: Stretch) -> dict[str, Mask]:
    segment, count = stretch.segment, stretch.segment.samples
    everywhere = np.ones(count, dtype=bool)
    place = np.arange(count) / max(count, 1)
    masks = {
        f"condition {segment.condition}": everywhere,
        "early third of the records": place < 1 / 3,
        "late third of the records": place >= 2 / 3,
    }
    if segment.cycles:
        masks[f"frequency {segment.frequency:.3g} Hz"] = everywhere
        masks[f"amplitude {segment.amplitude:.3g} {unit_of(segment.drive)} ({segment.drive})"] = everywhere
    masks |= _motion(bench, stretch)
    masks |= _electric(bench, stretch)
    return masks


def _motion(bench: Bench, stretch: Stretch) -> dict[str, Mask]:
    masks: dict[str, Mask] = {}
    x, v = stretch.channel("displacement"), stretch.channel("velocity")
    if v is not None:
        fastest = float(np.max(np.abs(v))) or 1.0
        masks["pre-yield (slow: |v| below 15 % of its peak)"] = np.abs(v) < STANDARD.pre_yield * fastest
        masks["post-yield (fast: |v| above 15 % of its peak)"] = np.abs(v) >= STANDARD.pre_yield * fastest
        masks["near reversal of the motion"] = _near_reversal(v, stretch.block.dt, stretch.segment.frequency)
        masks["rebound (v > 0)"] = v > 0
        masks["compression (v < 0)"] = v < 0
        top = max(_span(bench, "velocity"), 1e-300)
        masks["high speed (|v| above 70 % of the largest)"] = np.abs(v) > STANDARD.high_speed * top
    if x is not None:
        masks["end of stroke (|x| above 90 % of the largest)"] = np.abs(x) > STANDARD.stroke_end * _span(
            bench, "displacement"
        )
    return masks


def _electric(bench: Bench, stretch: Stretch) -> dict[str, Mask]:
    masks: dict[str, Mask] = {}
    i, temperature = stretch.channel("current"), stretch.channel("temperature")
    if i is not None and float(np.ptp(i)) > 0.0:
        top = _span(bench, "current")
        masks["high current (|i| above 80 % of the largest)"] = np.abs(i) > STANDARD.high_current * top
        masks["low current (|i| below 20 % of the largest)"] = np.abs(i) < STANDARD.low_current * top
        if stretch.segment.drive == "current":
            slope = np.gradient(i)
            masks["near reversal of the current"] = _near_reversal(slope, stretch.block.dt, stretch.segment.frequency)
        else:
            up, down = _after_steps(i, stretch.block.dt, top)
            masks["0-40 ms after a current step up"] = up
            masks["0-40 ms after a current step down"] = down
    elif i is not None:
        masks[f"current {i[0]:.3g} A"] = np.ones(len(i), dtype=bool)
    if temperature is not None:
        low, high = _ends(bench, "temperature")
        masks["cold third"] = temperature < low + (high - low) / 3
        masks["hot third"] = temperature > high - (high - low) / 3
    return masks


def _near_reversal(rate: Array, dt: float, frequency: float) -> Mask:
    """Return the samples near a change of the rate's sign: a twentieth of a cycle (20 ms where there is no cycle)."""
    turns = np.flatnonzero(np.diff(np.sign(rate)) != 0)
    reach = max(int((STANDARD.near_reversal / frequency if frequency > 0 else STANDARD.near_reversal_time) / dt), 1)
    marks = np.zeros(len(rate) + 1)
    np.add.at(marks, np.maximum(turns - reach, 0), 1.0)
    np.add.at(marks, np.minimum(turns + reach + 1, len(rate)), -1.0)
    return np.cumsum(marks)[:-1] > 0


def _after_steps(current: Array, dt: float, top: float) -> tuple[Mask, Mask]:
    """Return the samples at most 40 ms after the current rose, and after it fell, by a step."""
    short, window = max(int(STANDARD.step_rise * STANDARD.step_window / dt), 1), max(int(STANDARD.step_window / dt), 1)
    change = np.zeros(len(current))
    change[short:] = current[short:] - current[:-short]
    masks = []
    for sign in (1.0, -1.0):
        steps = np.convolve(sign * change > STANDARD.step_share * top, np.ones(window))[: len(current)]
        masks.append(steps > 0)
    return masks[0], masks[1]


def _span(bench: Bench, name: str) -> float:
    low, high = _ends(bench, name)
    return max(abs(low), abs(high))


def _ends(bench: Bench, name: str) -> tuple[float, float]:
    values = [c for s in bench.stretches if (c := s.channel(name)) is not None]
    return min(float(v.min()) for v in values), max(float(v.max()) for v in values)


def in_words(regions: Sequence[Region], policy: Policy) -> list[str]:
    """Return the regions that hold more of the error than their samples, as sentences."""
    worth = [r for r in regions if r.excess > policy.region_told][: policy.most_said]
    return [
        f"{r.name}: {100.0 * r.share_of_error:.0f} % of the squared error in {100.0 * r.share_of_samples:.0f} % of "
        "the samples"
        for r in worth
    ]


def beyond_training(bench: Bench, policy: Policy) -> list[str]:
    """Return a sentence for each input that held-out tests take further than the training tests did."""
    said = []
    for name in ("current", "velocity", "angular_velocity", "temperature"):
        if name not in bench.channels:
            continue
        (low, high), (least, most) = (_range(bench.of_role(role), name) for role in ("train", "holdout"))
        margin = policy.extrapolates * max(high, -low, most, -least)
        if least < low - margin or most > high + margin:
            unit = unit_of(name)
            said.append(
                f"held-out tests span {least:.3g} to {most:.3g} {unit} of {name.replace('_', ' ')}, training tests "
                f"only {low:.3g} to {high:.3g} {unit}: there the model extrapolates; hold out other tests "
                "(`mrfit segment --holdout PATTERN`)"
            )
    return said


def not_determined(bench: Bench, base: Refit, left: float, policy: Policy) -> str:
    """Return a sentence on the held-out tests at which the training tests do not determine a base.

    Parameters
    ----------
    bench
        The data.
    base
        The base as fitted to the training tests.
    left
        Error of a fit to all tests on the held-out ones, in multiples of the noise floor.
    policy
        The thresholds.
    """
    errors = zip(bench.of_role("holdout"), base.holdout, strict=True)
    tests = dict.fromkeys(_setting(s) for s, error in errors if usual([error]) > policy.clearly_above)
    return (
        f"a fit to all tests leaves {left:.2g} noise floors where a fit to the training tests leaves "
        f"{base.chi('holdout'):.2g}: these do not determine the base at {', '.join(tests)}; "
        "log a second test at each of these settings and hold out only one of the two"
    )


def _setting(stretch: Stretch) -> str:
    """Return a test's condition with its largest speed and current."""
    parts = []
    for name in (*(rate for _, rate, _ in MOTION.values()), CONTROL):
        values = stretch.channel(name)
        if values is not None:
            parts.append(f"{float(np.max(np.abs(values))):.2g} {unit_of(name)}")
    return f"{stretch.segment.condition} (up to {' and '.join(parts)})" if parts else stretch.segment.condition


def _range(stretches: Sequence[Stretch], name: str) -> tuple[float, float]:
    values = np.concatenate([v for s in stretches if (v := s.channel(name)) is not None])
    return float(values.min()), float(values.max())
