"""Tests that an experiment asks for and that were made, so that nobody is asked for them again."""

from collections.abc import Callable, Iterable, Sequence
from itertools import zip_longest

import numpy as np

from mrfit.core.recording import Segment
from mrfit.core.specs import EffectSpec, Programme
from mrfit.discover.policy import STANDARD


def still_to_do(effect: EffectSpec, segments: Sequence[Segment]) -> str:
    """Return the experiment that tells an effect from others, less the parts whose tests have been made."""
    parts = effect.experiment.split("; ")
    left = [p for p, asked in zip_longest(parts, effect.asks) if p and not (asked and is_there(asked, segments))]
    return "; ".join(left).removeprefix("or ")


def is_there(asked: Programme, segments: Iterable[Segment]) -> bool:
    """Return whether the tests of a programme have been made."""
    made = [s for s in segments if s.frequency > 0.0 and asked.waveform in ("", s.waveform)]
    frequency, amplitude, current = (_levels(made, of) for of in (_frequency, _amplitude, _current))
    speed = _levels(made, lambda s: s.frequency * s.amplitude)
    wanted = (
        (asked.frequencies, asked.ratio, frequency, (amplitude, current)),
        (asked.amplitudes, 1.0, amplitude, (frequency, current)),
        (asked.currents, 1.0, current, (frequency, amplitude)),
        (asked.speeds, 1.0, speed, (current,)),
    )
    return bool(made) and all(
        any(_enough(own, least, ratio) for own in _grouped(values, held))
        for least, ratio, values, held in wanted
        if least
    )


def _enough(values: Sequence[float], least: int, ratio: float) -> bool:
    found = sorted(set(values))
    return len(found) >= least and (ratio == 1.0 or found[-1] >= STANDARD.reached_ratio * ratio * found[0])


def _grouped(values: Sequence[float], held: Sequence[Sequence[float]]) -> list[list[float]]:
    """Return the values of tests that agree in all that is held."""
    groups: dict[tuple[float, ...], list[float]] = {}
    for value, *rest in zip(values, *held, strict=True):
        groups.setdefault(tuple(rest), []).append(value)
    return list(groups.values())


def _levels(made: Sequence[Segment], of: Callable[[Segment], float]) -> list[float]:
    """Return a setting of every test, the same number for those that are alike."""
    values = np.array([of(s) for s in made])
    order, level = np.argsort(values), 0.0
    found = np.empty(len(values))
    scale = float(np.max(np.abs(values), initial=0.0))
    for k, at in enumerate(order):
        # a current of zero is held within a share of the greatest
        if not k or values[at] - level > STANDARD.alike_tests * max(abs(values[at]), STANDARD.alike_zero_tests * scale):
            level = float(values[at])
        found[at] = level
    return found.tolist()


def _frequency(segment: Segment) -> float:
    return segment.frequency


def _amplitude(segment: Segment) -> float:
    return segment.amplitude


def _current(segment: Segment) -> float:
    return segment.current if np.isfinite(segment.current) else 0.0
