"""Records of a law that mrfit does not have, with a force that no effect describes."""

from collections.abc import Mapping
from functools import cache

import numpy as np

from mrfit.core.specs import Array
from mrfit.discover.formula.proposal import Proposal, propose
from mrfit.discover.invariance.records import Record
from mrfit.discover.policy import STANDARD
from tests.discover.invariance.specimens import Force, no_effect, records

SIZE, CENTRE, WIDTH = 120.0, 3e-3, 3e-3


def bump(channels: Mapping[str, Array], force: Array) -> Array:
    """Add friction at one place of the stroke, of 120 N in about 3000 N."""
    place = np.exp(-(((channels["displacement"] - CENTRE) / WIDTH) ** 2))
    return np.asarray(force + SIZE * place * np.tanh(channels["velocity"] / 5e-3))


def rebound(channels: Mapping[str, Array], force: Array) -> Array:
    """Add a resistance of one direction, that grows with the square of the velocity."""
    return np.asarray(force + 2500.0 * np.maximum(channels["velocity"], 0.0) ** 2)


def gain(channels: Mapping[str, Array], force: Array) -> Array:
    """Let the law's force grow away from the middle of the stroke."""
    return np.asarray(force * (1.0 + 8e2 * channels["displacement"] ** 2))


def parted(effect: Force = no_effect, seed: int = 0) -> tuple[list[Record], list[Record]]:
    """Return the records to learn from and those held out."""
    made = records(effect, seed=seed)
    held = [k for k in range(len(made)) if k in (3, 6)]
    return [r for k, r in enumerate(made) if k not in held], [made[k] for k in held]


@cache
def found(effect: Force = no_effect, seed: int = 0) -> Proposal:
    """Return the proposal for an effect."""
    return propose(*parted(effect, seed), None, STANDARD)
