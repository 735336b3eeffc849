"""Runs of neighbouring samples at which something holds."""

import numpy as np

from mrfit.core.specs import Index, Mask


def runs(mask: Mask) -> Index:
    """Return the first sample of each run in which a mask (N,) is true, and the sample behind the run, (R, 2)."""
    steps: Index = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return steps.reshape(-1, 2)


def longest_run(mask: Mask) -> int:
    """Return the most neighbouring samples for which a mask (N,) is true."""
    return int(np.max(np.diff(runs(mask)), initial=0))
