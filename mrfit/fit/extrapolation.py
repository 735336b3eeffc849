"""Where a prediction leaves what a fit was made from: current, speed, stroke, temperature and every other input."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mrfit.core import registry
from mrfit.core.channels import CONTROL, INTEGRALS, WARMTH, unit_of
from mrfit.core.counting import number_of
from mrfit.core.recording import RECORD_CONSTANTS
from mrfit.core.specs import Array
from mrfit.io.schemas.fit import Caution

SLACK = 0.05
"""Share of the range fitted, or of a level held, by which a prediction may go beyond it: noise and a rig's accuracy."""
RATES = dict(INTEGRALS)
"""Channel -> its rate, which is looked at where only the channel is an input."""


@dataclass(frozen=True)
class ConditionInputs:
    """The inputs of a test.

    Attributes
    ----------
    condition
        Its name.
    dt
        Sample interval in s.
    inputs
        Channels, SI, shape (N,) each.
    temperature
        Of the specimen in °C, nan where it is not known.
    drive, amplitude
        What was driven and how far, SI; looked at where it is no input.
    """

    condition: str
    dt: float
    inputs: Mapping[str, Array]
    temperature: float = float("nan")
    drive: str = ""
    amplitude: float = float("nan")

    def extents(self) -> dict[str, tuple[float, float]]:
        """Return least and greatest value of every input, of the rate of a place, of the drive and the temperature."""
        inputs = {name: v for name, v in self.inputs.items() if len(v) and name not in RECORD_CONSTANTS}
        found = {name: (float(np.min(v)), float(np.max(v))) for name, v in inputs.items()}
        for place, rate in RATES.items():
            if place in self.inputs and rate not in self.inputs and len(self.inputs[place]) > 2:
                speed = np.gradient(self.inputs[place], self.dt)
                found[rate] = (float(speed.min()), float(speed.max()))
        if self.drive and self.drive not in found and np.isfinite(self.amplitude):
            found[self.drive] = (-self.amplitude, self.amplitude)
        if np.isfinite(self.temperature) and WARMTH not in found:
            found[WARMTH] = (self.temperature, self.temperature)
        return found


Extents = Mapping[str, tuple[float, float]]
"""Least and greatest value of every channel."""


def together(extents: Iterable[Extents]) -> dict[str, tuple[float, float]]:
    """Return least and greatest value of every channel over several tests."""
    found: dict[str, tuple[float, float]] = {}
    for one in extents:
        for name, (low, high) in one.items():
            least, most = found.get(name, (low, high))
            found[name] = (min(low, least), max(high, most))
    return found


def beyond(trained: Extents, reached: Extents) -> float:
    """Return how far a test leaves the range of a fit: log(1 + overshoot / size) of the channel that leaves it most."""
    shares = [
        max(low - reached[name][0], reached[name][1] - high) / size - SLACK
        for name, (low, high) in trained.items()
        if name in reached and (size := _size(low, high)) > 0.0
    ]
    return math.log1p(max([0.0, *shares]))


def is_new_current(fitted: Iterable[Extents], reached: Extents) -> bool:
    """Return whether a test has currents that no fitted test had: a law of current alone says what happens there."""
    spans = [e[CONTROL] for e in fitted if CONTROL in e]
    if not spans or CONTROL not in reached:
        return False
    slack = SLACK * _size(min(low for low, _ in spans), max(high for _, high in spans))
    low, high = reached[CONTROL]
    return not any(a - slack <= low and high <= b + slack for a, b in spans)


def _size(low: float, high: float) -> float:
    """Return the range of a channel, or its level where that is more."""
    return max(high - low, abs(low), abs(high))


def extrapolations(trained: Extents, predicted: Sequence[ConditionInputs]) -> list[Caution]:
    """Return a warning for every channel that leaves the range in which the model was fitted, with the worst test."""
    said = []
    for name, (low, high) in trained.items():
        slack = SLACK * _size(low, high)
        worst = ("", 0.0, 0.0)
        count = 0
        for stretch in predicted:
            least, most = stretch.extents().get(name, (low, high))
            beyond = max(least_beyond := low - least, most - high)
            if beyond > slack:
                count += 1
                if beyond > worst[1]:
                    worst = stretch.condition, beyond, least if least_beyond == beyond else most
        if count:
            said.append(_caution(name, (low, high), worst[0], worst[2], count))
    return said


def outside(model: str, reached: Iterable[Extents]) -> list[Caution]:
    """Return a warning for every effect of a written model that tests take beyond what it was found on."""
    found, all_reached = [], together(reached)
    for spec in (registry.load("effect", name).SPEC for name in registry.elements(model)[1]):
        left = [(n, low, high) for n, low, high in spec.within if beyond({n: (low, high)}, all_reached) > 0.0]
        if left:
            here = ranges_text([(n, *all_reached[n]) for n, *_ in left])
            text = f"{spec.name} was found at {ranges_text(left)}; here is {here}: what it says beyond is not tested"
            found.append(Caution(kind="extrapolation", text=text))
    return found


def ranges_text(ranges: Sequence[tuple[str, float, float]]) -> str:
    """Return channels with their least and greatest value in words."""
    return ", ".join(f"{n.replace('_', ' ')} {low:.4g} to {high:.4g} {unit_of(n) or 's'}" for n, low, high in ranges)


def _caution(name: str, fitted: tuple[float, float], condition: str, reached: float, count: int) -> Caution:
    unit = unit_of(name)
    low, high = fitted
    span = f"{high:.4g}" if np.isclose(low, high) else f"{low:.4g} to {high:.4g}"
    others = f" and {number_of('more segment', count - 1)}" if count > 1 else ""
    text = (
        f"{name.replace('_', ' ')} reaches {reached:.4g} {unit} in {condition}{others}; the fit was made at "
        f"{span} {unit}: what the model says beyond is not tested"
    )
    return Caution(kind="extrapolation", text=text)
