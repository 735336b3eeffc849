"""Noise of any colour does not know the state of the specimen; a disturbance that acts through it does."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from mrfit.discover.evidence.residual_structure import _halves, powers_by_output
from mrfit.discover.policy import STANDARD

PERIOD, CYCLES = 250.0, 18


def scores(rng: np.random.Generator, disturbance: str) -> tuple[float, float]:
    """Return the log ratio and its score for noise alone, or for a modulation of the output by a slow rhythm."""
    n = np.arange(int(PERIOD * CYCLES))
    output = np.sin(2 * np.pi * n / PERIOD)
    pole = 0.95 if disturbance == "coloured" else 0.0
    error = lfilter([np.sqrt(1 - pole**2)], [1, -pole], rng.standard_normal(len(n)))
    if disturbance == "modulation":
        error = error + 4.0 * output * np.sin(0.37 * 2 * np.pi * n / PERIOD + rng.uniform(0, 6))
    stretch = SimpleNamespace(block=SimpleNamespace(period=PERIOD), measured=output)
    found = _halves(error, stretch, CYCLES)
    return found.log_ratio, found.score


@pytest.mark.parametrize(("disturbance", "seen"), [("white", False), ("coloured", False), ("modulation", True)])
def test_only_what_acts_through_the_specimen_depends_on_the_output(disturbance: str, seen: bool) -> None:
    rng = np.random.default_rng(6)
    ratio, score = np.median(np.abs([scores(rng, disturbance) for _ in range(12)]), axis=0)
    assert (ratio > np.log(1.35) and score > 2.0) == seen


def test_records_of_too_few_cycles_are_not_asked() -> None:
    rng = np.random.default_rng(8)

    def stretch(cycles: int) -> SimpleNamespace:
        n = np.arange(int(PERIOD * cycles))
        block = SimpleNamespace(period=PERIOD)
        return SimpleNamespace(block=block, measured=np.sin(2 * np.pi * n / PERIOD), repeats=True)

    train, holdout = [stretch(4), stretch(3)], [stretch(6)]
    bench = SimpleNamespace(of_role=lambda role: train if role == "train" else holdout)
    errors = {
        role: [rng.standard_normal(len(s.measured)) for s in found] for role, found in (("t", train), ("h", holdout))
    }
    fit = SimpleNamespace(train=errors["t"], holdout=errors["h"])
    for fewest, records in ((3, 3), (STANDARD.fewest_cycles, 2), (7, 0)):
        assert len(powers_by_output(bench, fit, fewest)) == records  # type: ignore[arg-type]
