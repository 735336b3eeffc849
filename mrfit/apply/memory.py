"""Models and effects with memory, one step at a time: what they keep, and how it goes on.

An element has ``rest(now, dt)``, its state where the channels have stood still, and ``step(state, before, now, dt)``,
which returns its output and its next state and leaves the given state as it is. Channels map names to values (B,), one
for each lane; ``theta`` of a model is (K, B). A step lasts ``dt`` seconds and may have any length.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import lsim

from mrfit.core.specs import Array
from mrfit.kernels.branch import normal_form
from mrfit.kernels.lti import SHORTEST, exponential
from mrfit.kernels.sliding import CREEP
from mrfit.kernels.stepping import bouc_wen_step, lugre_step, spencer_step
from mrfit.models.neural_network import LAG

Channels = Mapping[str, Array]
# Time constants after which what a filter remembers is forgotten, and the share of a sample below which it is none
_FELT, _SHORT = 10.0, 0.01


class Base(Protocol):
    """A base model with memory; both methods take the parameters (K, B) of the moment."""

    def rest(self, now: Channels, theta: Array) -> Any:
        """Return the state of a damper that has stood still."""

    def step(self, state: Any, before: Channels, now: Channels, theta: Array, dt: float) -> tuple[Array, Any]:
        """Return the force (B,) and the next state."""


class Element(Protocol):
    """An effect with memory; its parameters were given when it was made."""

    def rest(self, now: Channels, signal: Array) -> Any:
        """Return the state where the channels, and the signal that the effect acts on, have stood still."""

    def step(
        self, state: Any, before: Channels, now: Channels, signals: tuple[Array, Array], dt: float
    ) -> tuple[Array, Any]:
        """Return what becomes of the signal, given before and now, or what is added to it, and the next state."""


@dataclass(frozen=True)
class BoucWen:
    """``boucwen``: the state is y = z/z_max."""

    def rest(self, now: Channels, theta: Array) -> Array:
        """Return y = 0."""
        return np.zeros_like(now["displacement"])

    def step(self, state: Array, before: Channels, now: Channels, theta: Array, dt: float) -> tuple[Array, Array]:
        """Return the force (B,) and y."""
        c, k, x0, alpha, kappa, beta, gamma, n = theta
        x, v = now["displacement"], now["velocity"]
        z_max, rate, rho = normal_form(kappa, beta, gamma, n)
        y = bouc_wen_step(state, x - before["displacement"], rate, n, rho)
        return c * v + k * (x - x0) + alpha * z_max * y, y


@dataclass(frozen=True)
class Dahl:
    """``dahl``: the state is w, between -1 and 1; a step is exact."""

    def rest(self, now: Channels, theta: Array) -> Array:
        """Return w = 0."""
        return np.zeros_like(now["displacement"])

    def step(self, state: Array, before: Channels, now: Channels, theta: Array, dt: float) -> tuple[Array, Array]:
        """Return the force (B,) and w."""
        c, fy, rho, f0 = theta
        travel = now["displacement"] - before["displacement"]
        w = state - np.expm1(-rho * np.abs(travel)) * (np.sign(travel) - state)
        return f0 + c * now["velocity"] + fy * w, w


@dataclass(frozen=True)
class LuGre:
    """``lugre``: the state is the bristles' deflection in m."""

    def rest(self, now: Channels, theta: Array) -> Array:
        """Return no deflection."""
        return np.zeros_like(now["velocity"])

    def step(self, state: Array, before: Channels, now: Channels, theta: Array, dt: float) -> tuple[Array, Array]:
        """Return the force (B,) and the deflection."""
        return lugre_step(state, np.stack([before["velocity"], now["velocity"]]), np.ascontiguousarray(theta), dt)


@dataclass(frozen=True)
class Spencer:
    """``spencer``: the states are xi = x - y in m and z; ``usual`` parameters (10,) choose the sub-steps."""

    usual: Array | None = None

    def tuned(self, theta: Array) -> "Spencer":
        """Return it for a damper whose parameters (10,) are these in the middle of its range of current."""
        return Spencer(np.ascontiguousarray(theta))

    def rest(self, now: Channels, theta: Array) -> Array:
        """Return xi = z = 0."""
        return np.zeros((2, len(now["displacement"])))

    def step(self, state: Array, before: Channels, now: Channels, theta: Array, dt: float) -> tuple[Array, Array]:
        """Return the force (B,) and xi, z."""
        ends = np.stack([before["velocity"], now["velocity"]])
        own = np.ascontiguousarray(theta)
        usual = own[:, 0].copy() if self.usual is None else self.usual
        return spencer_step(state, ends, np.ascontiguousarray(now["displacement"]), own, usual, dt)


@dataclass(frozen=True)
class Past:
    """Samples of a signal as far back as a delay reaches: ages (H,) in s, rising from 0, and values (H, B)."""

    ages: Array
    values: Array

    @classmethod
    def still(cls, value: Array) -> "Past":
        """Return the past of a signal that has stood still."""
        return cls(np.zeros(1), value[None])

    def after(self, value: Array, dt: float, reach: float) -> "Past":
        """Return it with a new sample, without what is older than ``reach`` and not needed to read the value there."""
        if dt == 0.0:
            return Past(self.ages, np.concatenate([value[None], self.values[1:]]))
        ages = np.concatenate([[0.0], self.ages + dt])
        kept = int(np.searchsorted(ages, reach, "right")) + 1
        return Past(ages[:kept], np.concatenate([value[None], self.values])[:kept])

    def at(self, age: float) -> Array:
        """Return the signal (B,) so many s ago, linear between samples, the oldest value before them."""
        k = int(np.searchsorted(self.ages, age, "right"))
        if k >= len(self.ages):
            return np.asarray(self.values[-1])
        share = (age - self.ages[k - 1]) / (self.ages[k] - self.ages[k - 1])
        return np.asarray(self.values[k - 1] + share * (self.values[k] - self.values[k - 1]))


@dataclass(frozen=True)
class Network:
    """``neural-network``: the state is the past of velocity and current, as far back as its second inputs reach."""

    def rest(self, now: Channels, theta: Array) -> tuple[Past, Past]:
        """Return inputs that stood still."""
        return Past.still(now["velocity"]), Past.still(now["current"])

    def step(
        self, state: tuple[Past, Past], before: Channels, now: Channels, theta: Array, dt: float
    ) -> tuple[Array, tuple[Past, Past]]:
        """Return the force (B,) and the pasts."""
        v, i = (p.after(now[n], dt, LAG) for p, n in zip(state, ("velocity", "current"), strict=True))
        inputs = np.stack([now["velocity"], now["current"], v.at(LAG), i.at(LAG)])
        first = np.tanh(np.einsum("jkb,kb->jb", theta[:12].reshape(3, 4, -1), inputs) + theta[12:15])
        second = np.tanh(np.einsum("jkb,kb->jb", theta[15:24].reshape(3, 3, -1), first) + theta[24:27])
        return np.sum(theta[27:30] * second, axis=0) + theta[30], (v, i)


@dataclass(frozen=True)
class Delayed:
    """A pure delay in s; one below 0, which foresees, is none."""

    delay: float

    def rest(self, now: Channels, signal: Array) -> Past:
        """Return a past that stood still."""
        return Past.still(signal)

    def step(
        self, state: Past, before: Channels, now: Channels, signals: tuple[Array, Array], dt: float
    ) -> tuple[Array, Past]:
        """Return the signal of some time ago."""
        past = state.after(signals[1], dt, max(self.delay, 0.0))
        return past.at(max(self.delay, 0.0)), past

    @property
    def lasting(self) -> float:
        """Return for how many s a signal is felt behind it."""
        return max(self.delay, 0.0)

    def undone(self, signal: Array, dt: float) -> Array:
        """Return the signals (L, N) before it of those wanted behind it: known ahead, their last value beyond."""
        time = dt * np.arange(signal.shape[1])
        return np.stack([np.interp(time + self.lasting, time, row) for row in signal])


@dataclass(frozen=True)
class FirstOrder:
    """y + tau*dy/dt = u, exact where u is linear between the ends of a step, or held (``held``) at its new value."""

    tau: float
    held: bool = False

    def rest(self, now: Channels, signal: Array) -> Array:
        """Return y = u."""
        return signal

    def step(
        self, state: Array, before: Channels, now: Channels, signals: tuple[Array, Array], dt: float
    ) -> tuple[Array, Array]:
        """Return y and y."""
        if self.tau <= 0.0:
            return signals[1], signals[1]
        ratio = dt / self.tau
        kept, follow = np.exp(-ratio), -np.expm1(-ratio) / ratio if ratio > 0.0 else 1.0
        start = signals[1] if self.held else signals[0]
        y = signals[1] + kept * (state - start) - follow * (signals[1] - start)
        return y, y

    @property
    def lasting(self) -> float:
        """Return for how many s a signal is felt behind it, to 5e-5."""
        return _FELT * max(self.tau, 0.0)

    def undone(self, signal: Array, dt: float) -> Array:
        """Return the signals (L, N) before it of smooth ones wanted behind it: u = y + tau*dy/dt."""
        if self.tau <= 0.0:
            return signal
        return np.asarray(signal + self.tau * _spline(signal, dt)(dt * np.arange(signal.shape[1]), 1))


@dataclass(frozen=True)
class UnitGain:
    """A cascade of real poles with unit gain and up to two zeros, as ``lti.unit_gain_filter``; states (S, B)."""

    poles: tuple[float, ...]
    zeros: tuple[float, float]
    held: bool = False

    def rest(self, now: Channels, signal: Array) -> Array:
        """Return the states at rest at the signal."""
        return np.repeat(signal[None], len(self.poles), axis=0)

    def step(
        self, state: Array, before: Channels, now: Channels, signals: tuple[Array, Array], dt: float
    ) -> tuple[Array, Array]:
        """Return output (B,) and states."""
        order, start = len(self.poles), signals[1] if self.held else signals[0]
        system = np.zeros((order + 2, order + 2))
        for i, pole in enumerate(self.poles):
            system[i, i], system[i, i - 1 if i else order] = -pole * dt, pole * dt
        system[order, order + 1] = 1.0
        matrix = exponential(system)
        following = matrix[:order, :order] @ state
        following += matrix[:order, order : order + 1] * start
        following += matrix[:order, order + 1 : order + 2] * (signals[1] - start)
        inner = following[-3] if order > 2 else signals[1]
        rate_before = self.poles[-2] * (inner - following[-2])
        rate = self.poles[-1] * (following[-2] - following[-1])
        first, second = self.zeros
        return following[-1] + first * rate + second * self.poles[-1] * (rate_before - rate), following

    @property
    def lasting(self) -> float:
        """Return for how many s a signal is felt behind it, to 5e-5."""
        return _FELT * float(np.sum(1.0 / np.array(self.poles)))

    def undone(self, signal: Array, dt: float) -> Array:
        """Return the signals (L, N) before it of smooth ones y wanted behind it.

        w + z_1*w' + z_2*w'' = y is solved for w, exact for y linear between samples; then u = prod(1 + s/p_i)*w, whose
        third and fourth derivatives follow from those of y. Time constants far below a sample are none.
        """
        first, second = self.zeros
        if 1.0 / min(self.poles) < _SHORT * dt:
            return signal
        gains = np.array([1.0])
        for pole in self.poles:
            gains = np.convolve(gains, [1.0, 1.0 / pole])
        time, spline = np.arange(signal.shape[1]) * np.float64(dt), _spline(signal, dt)
        system = np.array([[0.0, 1.0], [-1.0 / second, -first / second]]), np.array([[0.0], [1.0 / second]])
        both = [_followed(system, row, time) for row in signal]
        orders = [np.stack([w[:, k] for w in both]) for k in (0, 1)]
        for k in range(len(self.poles) - 1):
            orders.append((spline(time, k) - orders[k] - first * orders[k + 1]) / second)
        return np.asarray(sum(gain * own for gain, own in zip(gains, orders, strict=False)))


def _spline(signal: Array, dt: float) -> CubicSpline:
    return CubicSpline(dt * np.arange(signal.shape[1]), signal, axis=1)


def _followed(system: tuple[Array, Array], signal: Array, time: Array) -> Array:
    """Return the states (N, 2) of a system at rest at a signal's first value."""
    start = np.array([signal[0], 0.0])
    found = lsim((*system, np.eye(2), np.zeros((2, 1))), signal, time, X0=start)[2]
    return np.asarray(found)


@dataclass(frozen=True)
class Chain:
    """Elements one behind the other."""

    links: tuple[Any, ...]

    def rest(self, now: Channels, signal: Array) -> tuple[Any, ...]:
        """Return the states and the signals between, at rest: every link here has unit gain."""
        return tuple((link.rest(now, signal), signal) for link in self.links)

    def step(
        self, state: Any, before: Channels, now: Channels, signals: tuple[Array, Array], dt: float
    ) -> tuple[Array, Any]:
        """Return the last output and all states."""
        following = []
        for link, (own, passed) in zip(self.links, state, strict=True):
            value, after = link.step(own, before, now, signals, dt)
            following.append((after, value))
            signals = passed, value
        return signals[1], tuple(following)

    @property
    def lasting(self) -> float:
        """Return for how many s a signal is felt behind them."""
        return float(sum(link.lasting for link in self.links))

    def undone(self, signal: Array, dt: float) -> Array:
        """Return the signals (L, N) before them of those wanted behind them."""
        for link in reversed(self.links):
            signal = link.undone(signal, dt)
        return signal


@dataclass(frozen=True)
class Play:
    """A play of half-width w, at 0 or at the signal to start with."""

    width: float
    from_zero: bool = True

    def rest(self, now: Channels, signal: Array) -> Array:
        """Return where the play rests."""
        return np.clip(np.zeros_like(signal), signal - self.width, signal + self.width) if self.from_zero else signal

    def step(
        self, state: Array, before: Channels, now: Channels, signals: tuple[Array, Array], dt: float
    ) -> tuple[Array, Array]:
        """Return the play's output, twice."""
        y = np.clip(state, signals[1] - self.width, signals[1] + self.width)
        return y, y


@dataclass(frozen=True)
class Release:
    """A share h of the signal that follows at once away from 0 and back behind a lag, of ``slow-release``."""

    share: float
    tau: float

    def rest(self, now: Channels, signal: Array) -> Array:
        """Return the parts above and below 0 (2, B), at rest at the signal."""
        return np.stack([np.maximum(signal, 0.0), np.maximum(-signal, 0.0)])

    def step(
        self, state: Array, before: Channels, now: Channels, signals: tuple[Array, Array], dt: float
    ) -> tuple[Array, Array]:
        """Return the output (B,) and the parts."""
        rate = dt / self.tau
        kept, follow = np.exp(-rate), -np.expm1(-rate) / rate if rate else 1.0
        old, new = (np.stack([np.maximum(s, 0.0), np.maximum(-s, 0.0)]) for s in signals)
        parts = np.maximum(new, new + kept * (state - old) - follow * (new - old))
        return signals[1] + self.share * (parts[0] - parts[1] - signals[1]), parts


@dataclass(frozen=True)
class VelocityMemory:
    """``velocity-hysteresis`` about a stroke whose middle is 0: a log's mean stroke is not known while it is made."""

    omega: float
    play: Play

    def rest(self, now: Channels, signal: Array) -> Array:
        """Return the play's state."""
        return self.play.rest(now, signal)

    def step(
        self, state: Array, before: Channels, now: Channels, signals: tuple[Array, Array], dt: float
    ) -> tuple[Array, Array]:
        """Return the velocity that the base sees."""
        y, following = self.play.step(state, before, now, signals, dt)
        return y + self.omega * now["displacement"], following


@dataclass(frozen=True)
class Rubbing:
    """Seal friction, of ``coulomb-friction`` and ``stribeck``: size(v)*(x - play(x, r))/r*tanh(|v|/v_r)."""

    size: Callable[[Array], Array]
    reach: float
    turn: float

    def rest(self, now: Channels, signal: Array) -> Array:
        """Return the play's output."""
        return Play(self.reach).rest(now, now["displacement"])

    def step(
        self, state: Array, before: Channels, now: Channels, signals: tuple[Array, Array], dt: float
    ) -> tuple[Array, Array]:
        """Return the friction."""
        x, v = now["displacement"], now["velocity"]
        y = np.clip(state, x - self.reach, x + self.reach)
        return self.size(v) * (x - y) / self.reach * np.tanh(np.hypot(v, CREEP) / self.turn), y


def _current_lag(theta: Array, held: bool) -> Chain:
    return Chain((Delayed(float(theta[1])), FirstOrder(float(theta[0]), held)))


def _current_filter(theta: Array, held: bool) -> Chain:
    slowest, second, lead, tau = map(float, theta)
    if slowest <= 0.0:
        return Chain((Delayed(tau),))
    pole = 1.0 / max(slowest, SHORTEST)
    return Chain((Delayed(tau), UnitGain((pole, pole / second), (lead / pole, 0.0), held)))


def _force_filter(theta: Array, held: bool) -> Chain:
    slowest, second, third, fourth, turn, xi = map(float, theta)
    if slowest <= 0.0:
        return Chain(())
    slowest = max(slowest, SHORTEST)
    poles = tuple(1.0 / (slowest * r) for r in (1.0, second, third, fourth))
    return Chain((UnitGain(poles, (2.0 * xi * turn * slowest, (turn * slowest) ** 2)),))


def magnetisation(q: Array, zero: float, tau: float, held: bool) -> Chain:
    """Return M(s) of ``hammerstein-wiener`` of poles q (2,) and zero in 1/s, delay in s."""
    return Chain((Delayed(tau), UnitGain((float(q[0]), float(q[1])), (1.0 / zero, 0.0), held)))


def damping(poles: Array, omega: float, xi: float) -> Chain:
    """Return H(s) of ``hammerstein-wiener`` of poles (4,) in 1/s, zeros at omega in rad/s with damping ratio xi."""
    return Chain((UnitGain(tuple(map(float, poles)), (2.0 * xi / omega, 1.0 / omega**2)),))


def _delay(theta: Array, held: bool) -> Chain:
    tau, share = map(float, theta)
    filtered = max(share * tau, 0.0)
    return Chain((Delayed(tau - filtered), FirstOrder(filtered)))


def _residual_magnetism(theta: Array, held: bool) -> Play:
    return Play(float(theta[0]))


def _slow_release(theta: Array, held: bool) -> Release:
    return Release(*map(float, theta))


def _velocity_hysteresis(theta: Array, held: bool) -> VelocityMemory:
    return VelocityMemory(float(theta[0]), Play(float(theta[1])))


def _coulomb(theta: Array, held: bool) -> Rubbing:
    fc, reach, turn = map(float, theta)
    return Rubbing(lambda v: np.full_like(v, fc), reach, turn)


def _stribeck(theta: Array, held: bool) -> Rubbing:
    fs, vs, sharp, reach, turn = map(float, theta)
    return Rubbing(lambda v: fs * np.exp(-((np.abs(v) / vs) ** sharp)), reach, turn)


BASES: Mapping[str, Base] = {
    "boucwen": BoucWen(),
    "dahl": Dahl(),
    "lugre": LuGre(),
    "spencer": Spencer(),
    "neural-network": Network(),
}
"""Base models that keep states of their own."""
ELEMENTS: Mapping[str, Callable[[Array, bool], Element]] = {
    "current-lag": _current_lag,
    "current-filter": _current_filter,
    "residual-magnetism": _residual_magnetism,
    "slow-release": _slow_release,
    "velocity-hysteresis": _velocity_hysteresis,
    "coulomb-friction": _coulomb,
    "stribeck": _stribeck,
    "force-filter": _force_filter,
    "delay": _delay,
}
"""Effects that do, made of their parameters (Q,) and of whether a current is held over a step or linear."""
