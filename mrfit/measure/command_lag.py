"""Lag of an actual quantity behind its command, and its time to 95 % of a step.

    tau*dy/dt + y = g*u(t - t_d) + o

u command, y actual quantity, g gain (unit of y over that of u), o offset, t_d dead time (s), tau time constant (s).
Gain and offset are solved for. Slow motion shows the sum t_d + tau alone, by which y is late at low frequency; where a
pure dead time or a pure lag fits as well as both together, only that sum is told. The response time is that of the law,
t_d + tau*ln 20; where the command makes steps and rests after them, also the median over these, read off the record.

Source: the lag of a test rig behind its command and of a field behind its current, inverse-tanh paper section 3; the
definition by 95 % is that of its response time.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.kernels.filters import held_back, smooth_lag

# Share of a step after which it counts as made
RESPONSE_SHARE = 0.95
# Factor, and part of the actual quantity's motion, by which the error of a pure dead time, or of a pure lag, has to be
# above that of both, for them to be told apart
LAW_RATIO, LAW_PART = 1.02, 3e-3
# Share of the record after whose beginning it is compared: what came before the first sample is not known
LAG_BEGINNING = 0.02
# Longest dead time and time constant looked for, as a share of the record
LAG_LONGEST = 0.1
# Share of the command's range from which a change between two samples, of one that rests before and after, is a step
COMMAND_STEP = 0.02
# Share of a step within which the actual quantity may still move at the end of the rest
SETTLED_SHARE = 0.02
# Samples beyond which a record is looked at in so many
LAG_SAMPLES = 40_000


@dataclass(frozen=True, kw_only=True)
class CommandLag:
    """Lag of one record's actual quantity behind its command.

    Attributes
    ----------
    recording
        Its id.
    lag
        Time in s by which slow motion is late, t_d + tau.
    dead_time, time_constant
        t_d and tau in s; None where the record does not tell them apart.
    response_time
        t_d + tau*ln 20 in s; None where these are not told apart.
    measured_response, steps
        Median time in s to 95 % of a step, and of how many steps; None without any.
    gain
        Actual over command.
    error
        RMS of what the law leaves, over that of the actual quantity about its mean.
    """

    recording: str
    lag: float
    dead_time: float | None
    time_constant: float | None
    response_time: float | None
    measured_response: float | None
    steps: int
    gain: float
    error: float


def command_lag(name: str, command: Array, actual: Array, dt: float) -> CommandLag:
    """Return the lag of an actual quantity (N,) behind its command (N,), sampled every dt s.

    Raises
    ------
    DataError
        If the command does not move, or the actual quantity does not move with it.
    """
    if len(command) > LAG_SAMPLES:
        command, actual = command[:LAG_SAMPLES], actual[:LAG_SAMPLES]
    if not np.ptp(command) or not np.ptp(actual):
        what = "command" if not np.ptp(command) else "actual quantity"
        raise DataError(f"{name}: the {what} does not move; give a record in which it does")
    law = _Law(command.astype(np.float64), actual.astype(np.float64), dt)
    delay, first_order, both = law.fitted((1.0, 0.0)), law.fitted((0.0, 1.0)), law.fitted((1.0, 1.0))
    both = min(both, delay, first_order, key=law.error)
    least = law.error(both)
    if least > 0.9:
        raise DataError(f"{name}: the actual quantity does not follow this command; check the two channels")
    apart = max(law.error(delay), law.error(first_order)) > max(LAW_RATIO * least, float(np.hypot(least, LAW_PART)))
    times = both if apart else min(delay, first_order, key=law.error)
    steps = _steps(command, actual, dt)
    return CommandLag(
        recording=name,
        lag=float(sum(times)),
        dead_time=times[0] if apart else None,
        time_constant=times[1] if apart else None,
        response_time=times[0] + times[1] * float(np.log(1.0 / (1.0 - RESPONSE_SHARE))) if apart else None,
        measured_response=float(np.median(steps)) if steps else None,
        steps=len(steps),
        gain=law.gain(times),
        error=least,
    )


Times = tuple[float, float]


@dataclass(frozen=True)
class _Law:
    """The law with its gain and offset solved for."""

    command: Array
    actual: Array
    dt: float

    @property
    def first(self) -> int:
        """First sample that is compared."""
        return int(LAG_BEGINNING * len(self.command))

    @property
    def about(self) -> Array:
        """The actual quantity about its mean, (N,)."""
        kept = self.actual[self.first :]
        return np.asarray(kept - kept.mean())

    def late(self, times: Times) -> Array:
        """Return the command behind dead time and lag, about its mean."""
        dead, tau = (max(t, 0.0) / self.dt for t in times)
        moved = held_back(self.command[None], np.array([dead]))
        late = smooth_lag(moved, np.array([tau]))[0, self.first :]
        return np.asarray(late - late.mean())

    def gain(self, times: Times) -> float:
        """Return g."""
        late = self.late(times)
        return float(late @ self.about) / max(float(late @ late), 1e-300)

    def left(self, times: Times) -> Array:
        """Return the residual of the law over the RMS of the actual quantity about its mean, (N,)."""
        about = self.about
        return np.asarray((about - self.gain(times) * self.late(times)) / np.std(about))

    def error(self, times: Times) -> float:
        """Return its RMS."""
        return float(np.sqrt(np.mean(self.left(times) ** 2)))

    def fitted(self, free: Times) -> Times:
        """Return the times, of which those marked 1 are free, that leave least: from the best of a grid."""
        most = LAG_LONGEST * len(self.command) * self.dt
        grid = [0.0, *np.geomspace(0.25 * self.dt, most, 24)]
        parts = [(free[0] * t * share, free[1] * t * (1.0 - share)) for t in grid for share in self._shares(free)]
        best: Times = min(parts, key=self.error)
        scale = max(best[0] + best[1], self.dt)
        columns = [k for k in (0, 1) if free[k]]

        def times(point: Array) -> Times:
            found = list(best)
            for k, value in zip(columns, point, strict=True):
                found[k] = float(value) * scale
            return found[0], found[1]

        def left(point: Array) -> Array:
            return self.left(times(point))

        start, steps = np.array([best[k] / scale for k in columns]), np.full(len(columns), 1e-4)
        found = least_squares(left, start, bounds=(0.0, 10.0 + most / scale), diff_step=steps)
        return min(times(found.x), best, key=self.error)

    @staticmethod
    def _shares(free: Times) -> tuple[float, ...]:
        return (0.0, 0.5, 1.0) if all(free) else (free[0],)


def _steps(command: Array, actual: Array, dt: float) -> list[float]:
    """Return the times in s to 95 % of every step of a command that rests before and after it, as recorded."""
    change = np.abs(np.diff(command))
    at = np.flatnonzero(change > COMMAND_STEP * np.ptp(command))
    found = []
    for place, j in enumerate(at):
        before = at[place - 1] + 1 if place else 0
        after = at[place + 1] if place + 1 < len(at) else len(command) - 1
        held, rest = command[before : j + 1], command[j + 1 : after + 1]
        size = abs(rest[-1] - held[-1]) if len(rest) else 0.0
        if len(rest) < 8 or len(held) < 4 or np.ptp(rest) > COMMAND_STEP * size or np.ptp(held) > COMMAND_STEP * size:
            continue
        time = _to_95(actual[j : after + 1], float(np.median(actual[max(before, j - 3) : j + 1])), dt)
        if time is not None:
            found.append(time)
    return found


def _to_95(actual: Array, start: float, dt: float) -> float | None:
    """Return the time in s from which on a quantity is beyond 95 % of its way; None if it does not come to rest."""
    tail = actual[-max(3, len(actual) // 5) :]
    end = float(np.median(tail))
    way = end - start
    if not way or np.ptp(tail) > max(SETTLED_SHARE * abs(way), 4.0 * float(np.std(np.diff(tail)))):
        return None
    share = (actual - start) / way
    below = np.flatnonzero(share < RESPONSE_SHARE)
    if not len(below) or below[-1] + 1 >= len(share):
        return None
    k = int(below[-1])
    return float((k + (RESPONSE_SHARE - share[k]) / (share[k + 1] - share[k])) * dt)
