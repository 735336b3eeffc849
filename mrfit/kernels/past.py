"""Memory of an element of earlier steps, for dead times: a ring of samples, of which a step reads late values.

A past is a flat array: how many samples were pushed, how many places it has, how many signals a sample holds, and how
many numbers of the element's own follow; these, and then the places, each a time in s and the signals. The newest
sample is that of a step's beginning. The own numbers, -1 at first, are what a step has worked out and looks up as long
as it holds: they do not change a result.
"""

from typing import Any

from mrfit.kernels.jit import borrowing

RESERVED = 4


@borrowing
def begun(past: Any, places: int, signals: int, own: int) -> None:
    """Begin a past without samples."""
    past[0], past[1], past[2], past[3] = 0.0, places, signals, own
    for k in range(own):
        past[RESERVED + k] = -1.0


@borrowing
def pushed(past: Any, signals: Any, dt: float, least: float = 0.0) -> None:
    """Add the first signals of a tuple as a sample dt s after the newest.

    It takes the newest one's place where that is nearer than ``least`` s to the one before, so that places suffice.
    """
    count, kept = int(past[0]), int(past[2])
    newest = _place(past, 1)
    time = past[newest] + dt if count > 0 else 0.0
    if count < 2 or past[newest] - past[_place(past, 2)] >= least:
        past[0] = count + 1.0
    newest = _place(past, 1)
    past[newest] = time
    for k in range(kept):
        past[newest + 1 + k] = signals[k]


@borrowing
def _place(past: Any, back: int) -> int:
    """Return the place of the sample so many steps back, 1 the newest; the oldest known where there is none."""
    count, places = int(past[0]), int(past[1])
    oldest = max(count - places, 0)
    return RESERVED + int(past[3]) + (max(count - back, oldest) % places) * (int(past[2]) + 1)


@borrowing
def kept(past: Any, k: int, back: int) -> float:
    """Return signal k of the sample so many steps back, 1 that of a step's beginning; before the first, the first."""
    found: float = past[_place(past, back) + 1 + k]
    return found


@borrowing
def age_of(past: Any, back: int, dt: float) -> float:
    """Return the age at the end of a step of dt s of a sample so many steps back, 0 that end itself."""
    return past[_place(past, 1)] - past[_place(past, back)] + dt if back > 0 else 0.0


@borrowing
def place(past: Any, age: float, dt: float) -> tuple[int, float]:
    """Return between which samples, back and back - 1, a time lies ``age`` s before a step's end, and its share there.

    The share is 0 at the earlier sample and 1 at the later; 0 is the step's end. Before the first sample it is 0.
    """
    known = int(min(past[0], past[1]))
    if age < dt:
        return 1, 1.0 - age / dt
    # steps of one length lead there at once; of others, from there one by one
    back = 1 if dt <= 0.0 else max(min(int(age / dt), known - 1), 1)
    while back > 1 and age_of(past, back - 1, dt) >= age:
        back -= 1
    while back < known and age_of(past, back, dt) < age:
        back += 1
    older, newer = age_of(past, back, dt), age_of(past, back - 1, dt)
    if age >= older or older <= newer:
        return back, 0.0
    return back, (older - age) / (older - newer)


@borrowing
def late(past: Any, k: int, age: float, dt: float, now: float) -> float:
    """Return signal k, ``now`` at a step's end, so many s before, linear between samples; at most its first value."""
    if age <= 0.0:
        return now
    back, share = place(past, age, dt)
    older = kept(past, k, back)
    newer = now if back == 1 else kept(past, k, back - 1)
    return older + share * (newer - older)


@borrowing
def smooth_late(past: Any, k: int, age: float, dt: float, now: float) -> float:
    """Return the same of a smooth signal: on the cubic through two samples on either side, or through the last four."""
    known = int(min(past[0], past[1]))
    if age <= 0.0:
        return now
    back, share = place(past, age, dt)
    if share == 0.0 and back == known:
        return kept(past, k, back)
    newest = max(back - 2, 0)
    oldest = age_of(past, known, dt)
    first = oldest - age_of(past, known - 1, dt)
    total = 0.0
    for one in range(newest, newest + 4):
        weight = now if one == 0 else kept(past, k, one)
        # before its first value a signal had that value, at steps as long as the first
        own = age_of(past, one, dt) if one <= known else oldest + (one - known) * first
        for other in range(newest, newest + 4):
            if other != one:
                beside = age_of(past, other, dt) if other <= known else oldest + (other - known) * first
                weight *= (age - beside) / (own - beside)
        total += weight
    return total
