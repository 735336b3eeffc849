"""Examinations of laws that mrfit does not have: one effect is named, none where there is none."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from mrfit.core.registry import load
from mrfit.core.specs import Array, Invariance
from mrfit.discover.invariance.base import base_of
from mrfit.discover.invariance.examine import examine
from mrfit.discover.invariance.findings import LawFindings
from mrfit.discover.policy import STANDARD
from mrfit.discover.writing.beside_open_law import not_applicable
from mrfit.kernels.filters import lag, released
from mrfit.simulate.assembly import assemble
from tests.discover.invariance.specimens import DT, HALF_STROKE, Force, library, no_effect, records


def found(effect: Force = no_effect, **more: object) -> LawFindings:
    return examine(records(effect, **more), None, library())  # type: ignore[arg-type]


def spring(channels: Mapping[str, Array], force: Array) -> Array:
    return force + 4e3 * channels["displacement"]


def mass(channels: Mapping[str, Array], force: Array) -> Array:
    return force + 15.0 * channels["acceleration"]


def warm(channels: Mapping[str, Array], force: Array) -> Array:
    return force * np.exp(-0.01 * (channels["temperature"] - 25.0))


def lopsided(channels: Mapping[str, Array], force: Array) -> Array:
    return force * (1.0 + 0.1 * 0.5 * (1.0 + np.tanh(channels["velocity"] / 0.005)))


@pytest.mark.parametrize(
    ("effect", "name", "value"),
    [
        (mass, "inertia", 15.0),
        # a spring that bends and a torque that falls as it warms are named below
        *(
            pytest.param(*row, marks=pytest.mark.slow)
            for row in ((spring, "gas-spring", 4e3), (warm, "temperature", 0.01), (lopsided, "asymmetry", 0.1))
        ),
    ],
)
def test_an_effect_is_named_though_no_base_is_right(effect: Force, name: str, value: float) -> None:
    findings = found(effect)
    assert [e.name for e in findings.named] == [name]
    (named,) = findings.named
    own = named.parameters[0]
    assert own.value == pytest.approx(value, rel=0.1)
    assert own.low is not None
    assert own.high is not None
    assert own.low < value < own.high
    assert named.standing is not None and named.standing.share > STANDARD.share
    assert findings.errors.after < findings.errors.law
    breaks = load("effect", name).SPEC.breaks
    assert breaks is not None
    assert named.breaks is breaks.invariance


# a spring that does not bend is among the effects named above
@pytest.mark.parametrize("inverse_length", [pytest.param(0.0, marks=pytest.mark.slow), -8.0])
def test_a_spring_of_gas_bends_and_is_no_end_stop(inverse_length: float) -> None:
    theta = np.array([[4e3, inverse_length]])

    def gas(channels: Mapping[str, Array], force: Array) -> Array:
        return force + load("effect", "gas-spring").term(dict(channels), theta, DT)[0]

    (named,) = found(gas).named
    assert named.name == "gas-spring"
    for parameter, true in zip(named.parameters, theta[0], strict=True):
        assert parameter.low is not None and parameter.high is not None
        assert parameter.low < true < parameter.high
    assert named.parameters[0].value == pytest.approx(4e3, rel=0.1)


def test_a_field_that_lags_is_named_with_what_looks_alike() -> None:
    findings = found(moved=lambda i: lag(np.ascontiguousarray(i[None]), np.array([0.03 / DT]))[0])
    assert [e.name for e in findings.named] == ["current-lag"]
    assert findings.named[0].one_of == ("delay",)
    assert findings.named[0].parameters[0].value == pytest.approx(0.03, rel=0.2)


def test_a_lag_longer_than_the_steps_of_the_current_is_named_though_the_law_has_no_slope_to_it() -> None:
    def switched(i: Array) -> Array:
        return np.tile(np.repeat([0.0, 1.0, 0.3, 0.7], 8), len(i) // 32 + 1)[: len(i)]

    def late(i: Array) -> Array:
        return lag(np.ascontiguousarray(switched(i)[None]), np.array([0.06 / DT]))[0]

    rows = [replace(r, channels={**r.channels, "current": switched(r.control)}) for r in records(moved=late)]
    (named,) = examine(rows, None, library()).named
    assert named.name == "current-lag"
    assert named.parameters[0].value == pytest.approx(0.06, rel=0.2)


def test_a_dead_time_beside_a_lag_is_told_from_it() -> None:
    dead = 8

    def late(i: Array) -> Array:
        return lag(np.concatenate([np.full(dead, i[0]), i[:-dead]])[None], np.array([0.02 / DT]))[0]

    (named,) = found(moved=late).named
    values = {p.name: p for p in named.parameters}
    assert named.name == "current-lag"
    assert values["tau"].value == pytest.approx(0.02, rel=0.1)
    assert values["t_d"].value == pytest.approx(dead * DT, rel=0.1)
    assert values["t_d"].low is not None and values["t_d"].low > 0.0


def test_what_is_turned_down_has_the_strength_that_it_would_have() -> None:
    def weak(channels: Mapping[str, Array], force: Array) -> Array:
        return force + 60.0 * channels["displacement"]

    without, own = (
        {t.name: t.parameters[0] for t in examine(records(effect), None, library()).turned_down}["gas-spring"]
        for effect in (no_effect, weak)
    )
    assert (own.name, own.unit, own.low) == ("k_g", "N/m", None)
    assert own.value - without.value == pytest.approx(60.0, rel=0.2)


def slowly_gone(i: Array) -> Array:
    return i + 0.6 * (released(np.ascontiguousarray(i), 0.06 / DT) - i)


def test_a_field_that_is_released_slowly_is_no_lag() -> None:
    findings = found(moved=slowly_gone)
    assert [e.name for e in findings.named] == ["slow-release"]
    share, tau = findings.named[0].parameters
    assert share.value == pytest.approx(0.6, rel=0.2)
    assert tau.value == pytest.approx(0.06, rel=0.25)
    assert findings.named[0].one_of == load("effect", "slow-release").SPEC.breaks.alike


def test_where_the_current_only_falls_a_lag_and_a_slow_release_are_one_set() -> None:
    def stairs(i: Array) -> Array:
        return np.sort(i)[::-1]

    def late(i: Array) -> Array:
        return lag(np.ascontiguousarray(i[None]), np.array([0.05 / DT]))[0]

    rows = records(moved=lambda i: late(stairs(i)))
    down = [replace(r, channels={**r.channels, "current": stairs(r.control)}) for r in rows]
    (named,) = examine(down, None, library()).named
    assert {named.name, *named.one_of} >= {"current-lag", "slow-release"}


@pytest.mark.parametrize("offset", [60.0, pytest.param(-60.0, marks=pytest.mark.slow)])
def test_an_offset_is_named_where_no_base_has_one(offset: float) -> None:
    findings = found(lambda channels, force: force + offset)
    assert [e.name for e in findings.named] == ["force-offset"]
    assert findings.named[0].parameters[0].value == pytest.approx(offset, rel=0.05)


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_a_law_that_is_odd_and_soon_forgets_is_never_named(seed: int) -> None:
    findings = found(seed=seed)
    assert not findings.named
    assert not findings.broken
    assert {c.name for c in findings.confounded} >= {"coulomb-friction", "quadratic-drag", "stribeck"}


def test_a_ripple_over_the_place_reads_position_and_has_no_name() -> None:
    def rippling(channels: Mapping[str, Array], force: Array) -> Array:
        return force + 60.0 * np.sin(2.0 * np.pi * channels["displacement"] / (0.5 * HALF_STROKE))

    findings = found(rippling)
    assert not findings.named
    assert findings.broken[0].invariance is Invariance.POSITION


def test_two_effects_are_told_apart() -> None:
    findings = found(lambda channels, force: mass(channels, spring(channels, force)))
    assert {e.name for e in findings.named} == {"gas-spring", "inertia"}


def test_without_a_current_that_moves_its_effects_are_confounded() -> None:
    still = [r for r in records() if not r.moves]
    findings = examine(still, None, library())
    assert "current-lag" in {c.name for c in findings.confounded}


def test_what_a_base_has_is_confounded_and_its_law_is_said_to_be_off() -> None:
    rows, assembly = records(spring), assemble("tanh")
    findings = examine(rows, base_of(assembly, assembly.spec.start, rows), library())
    assert "gas-spring" in {c.name for c in findings.confounded}
    assert not findings.named
    assert findings.law_gap is not None
    assert findings.errors.base is not None
    assert findings.errors.base > findings.errors.law
    for kind in ("travel", "speed", "control"):
        assert sum(p.share_of_error for p in findings.law_gap.where if p.over == kind) == pytest.approx(1.0)


@pytest.mark.parametrize(("share", "applies"), [(1.0, True), (0.1, False)])
def test_too_few_samples_are_said_and_not_judged(share: float, applies: bool) -> None:
    short = [
        replace(
            r,
            channels={n: c[: int(share * len(c))] for n, c in r.channels.items()},
            output=r.output[: int(share * len(r.output))],
        )
        for r in records()
    ]
    assert (not examine(short, None, library()).not_applicable) is applies
    assert examine([], None, library()).not_applicable


@pytest.mark.parametrize(
    ("output", "channels", "applies"),
    [
        ("force", ("displacement", "velocity", "acceleration"), True),
        ("force", ("velocity",), False),
        ("flux", ("current",), False),
    ],
)
def test_only_forces_and_torques_of_a_known_motion_are_examined(
    output: str, channels: tuple[str, ...], applies: bool
) -> None:
    assert (not not_applicable(output, channels)) is applies


def test_a_torque_is_examined_as_a_force_is() -> None:
    turned = {"displacement": "angle", "velocity": "angular_velocity", "acceleration": "angular_acceleration"}
    rows = [
        replace(r, channels={turned.get(n, n): c for n, c in r.channels.items()}, made="torque") for r in records(warm)
    ]
    findings = examine(rows, None, library("torque"))
    assert [e.name for e in findings.named] == ["temperature"]
    assert findings.named[0].force.unit == "N*m"
