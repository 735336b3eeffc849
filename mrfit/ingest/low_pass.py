"""A logged channel without what is faster than asked for: the filter of a record, symmetric, so that nothing is late.

Where force and motion are filtered alike, what a linear model says of them holds; where the force alone is, its knees
are rounded, and the simulation's are not.
"""

from dataclasses import replace
from functools import cache

import numpy as np

from mrfit.core.recording import Recording
from mrfit.core.specs import Array
from mrfit.errors import ConfigError
from mrfit.ingest.decimate import smoothed
from mrfit.ingest.meaning.channel_map import Rules
from mrfit.ingest.refusal import Refusal

# Shares of the limit up to which all is kept and from which nothing is, and how much in dB is taken from that
PASS_BAND, STOP_BAND_BEGIN, STOP_BAND_ATTENUATION = 0.5, 1.5, 60.0


def low_passed(record: Recording, rules: Rules) -> Recording:
    """Return a recording whose channels are low-passed as a channel map asks: y_k = Σ_j h_j·x_{k+j}, j = −L … L.

    h is a Kaiser window's low-pass of unit gain; beyond its ends the record goes on mirrored at its first and last
    sample. A channel on disk is read as it is asked for.

    Raises
    ------
    Refusal
        If a channel is not in the log, the limit is above half its sample rate, or the log is shorter than the filter.
    """
    limits = {name: rules.low_pass[name] for name in record.channels if name in rules.low_pass}
    missing = sorted(set(rules.low_pass) - set(record.channels) - {"*"})
    if missing:
        remedy = f"there are {', '.join(record.channels)}; correct low_pass"
        raise Refusal(record.source, f"no channel '{missing[0]}' to low-pass", remedy)
    if "*" in rules.low_pass:
        limits = dict.fromkeys(record.channels, rules.low_pass["*"]) | limits
    channels, lines = dict(record.channels), []
    for name, limit in limits.items():
        weights = _weights(record, name, limit)
        channels[name] = smoothed(channels[name], weights)
        lines.append(
            f"{name} low-passed at {limit:.6g} Hz (−6 dB), zero phase: kept up to {PASS_BAND * limit:.6g} Hz, "
            f"{STOP_BAND_ATTENUATION:g} dB down from {STOP_BAND_BEGIN * limit:.6g} Hz"
        )
    return replace(record, channels=channels, history=(*record.history, *lines)) if lines else record


def checked(limits: tuple[tuple[str, float], ...]) -> dict[str, float]:
    """Return the limits in Hz of ``--low-pass`` by channel, ``*`` for all.

    Raises
    ------
    ConfigError
        If one is not above 0.
    """
    wrong = next((n for n, hz in limits if not 0.0 < hz < np.inf), None)
    if wrong is not None:
        raise ConfigError(f"--low-pass {wrong}: a limit in Hz is above 0, as --low-pass force=20")
    return dict(limits)


def _weights(record: Recording, name: str, limit: float) -> Array:
    fastest = 0.5 / record.dt
    if STOP_BAND_BEGIN * limit >= fastest:
        raise Refusal(
            record.source,
            f"a low-pass of {name} at {limit:g} Hz needs more than the {1.0 / record.dt:g} samples a second there are",
            f"give a limit below {fastest / STOP_BAND_BEGIN:.4g} Hz",
        )
    weights = _filter(limit * record.dt)
    if record.samples <= len(weights) // 2:
        reach, lasts = len(weights) // 2 * record.dt, record.samples * record.dt
        raise Refusal(
            record.source,
            f"a low-pass of {name} at {limit:g} Hz reaches {reach:.3g} s to either side of the log's {lasts:.3g} s",
            "give a higher limit",
        )
    return weights


@cache
def _filter(share: float) -> Array:
    """Return the weights (2L + 1,) of a low-pass at a share of the sample rate."""
    from scipy.signal import firwin, kaiserord

    taps, beta = kaiserord(STOP_BAND_ATTENUATION, 2.0 * (STOP_BAND_BEGIN - PASS_BAND) * share)
    return firwin(taps | 1, 2.0 * share, window=("kaiser", beta))
