"""What an effect adds is made from its own function, in its own slot."""

import json
from dataclasses import asdict
from types import SimpleNamespace

import numpy as np
import pytest

from mrfit.core.registry import load, names
from mrfit.core.specs import Array, Breaks, EffectSpec, Invariance, Param
from mrfit.discover.invariance.base import none
from mrfit.discover.invariance.estimate import force_of_law
from mrfit.discover.invariance.nuisance import scales_of
from mrfit.discover.invariance.screening import contribution
from mrfit.discover.invariance.sensitivity import (
    ExaminedEffect,
    added,
    changed,
    examined,
    factor,
    missing,
    moved,
    starts,
    step_of,
)
from mrfit.discover.invariance.setting import setting_of
from mrfit.discover.policy import STANDARD
from mrfit.kernels.filters import lag
from tests.discover.invariance.specimens import library, records

BREAKING = [n for n in names("effect") if load("effect", n).SPEC.breaks is not None]


def effect(name: str) -> ExaminedEffect:
    found = examined(load("effect", name))
    assert found is not None
    return found


def test_a_mass_adds_its_force() -> None:
    record = records()[0]
    np.testing.assert_allclose(added(effect("inertia"), record, np.array([2.0])), 2.0 * record.channels["acceleration"])


def test_a_factor_is_that_of_all_roles_together() -> None:
    record, b = records()[0], 0.01
    warm = record.warmth
    assert warm is not None
    np.testing.assert_allclose(factor(effect("temperature"), record, np.array([b, b])), np.exp(-b * (warm - 25.0)))
    assert effect("temperature").common
    assert not effect("inertia").common


def test_an_output_effect_lets_columns_pass_one_by_one() -> None:
    record = records()[0]
    columns = np.column_stack([record.speed, record.place])
    time = record.channels["time"]
    np.testing.assert_allclose(
        changed(effect("gain-drift"), record, np.array([0.1]), columns), columns * (1.0 + 0.1 * time)[:, None]
    )


def test_a_moved_current_is_the_effect_s_own() -> None:
    record = records()[2]
    behind = moved(effect("current-lag"), record, record.control, np.array([0.05, 0.0]))
    plain = lag(record.control[None], np.array([0.05 / record.dt]))[0]
    np.testing.assert_allclose(behind, plain, atol=0.05)
    assert np.max(np.abs(behind - record.control)) > 0.3


@pytest.mark.parametrize("name", BREAKING)
def test_screening_starts_within_the_bounds(name: str) -> None:
    own = effect(name)
    scales = scales_of(records())
    points = list(starts(own, scales, 0.0))
    assert points
    for theta in points:
        for value, param in zip(theta, own.spec.params, strict=True):
            assert param.low <= value <= param.high


@pytest.mark.parametrize("name", sorted(set(names("effect")) - set(BREAKING)))
def test_an_effect_that_breaks_no_invariance_is_not_tested(name: str) -> None:
    assert examined(load("effect", name)) is None


def test_a_step_is_small_and_never_zero() -> None:
    own = effect("gas-spring")
    assert 0.0 < step_of(own, 0, 0.0) < 1e3
    assert step_of(own, 0, 5e3) == pytest.approx(0.5)


def test_a_channel_that_is_not_there_or_does_not_move_is_said() -> None:
    own = effect("temperature")
    assert "temperature" in missing(own, frozenset({"velocity"}), {})
    assert "does not move" in missing(own, frozenset({"temperature"}), {"temperature": 0.5})
    assert not missing(own, frozenset({"temperature"}), {"temperature": 5.0})


def test_an_effect_of_a_plug_in_takes_part() -> None:
    spec = EffectSpec(
        "cubic-spring", "", "", "", "add", ("force",), ("displacement",), (Param("k3", "N/m^3", -1e9, 1e9, 0.0),),
        (0.0,), breaks=Breaks(Invariance.POSITION),
    )  # fmt: skip

    def term(channels: dict[str, Array], theta: Array, dt: float) -> Array:
        return theta[:, :1] * channels["displacement"] ** 3

    own = examined(SimpleNamespace(SPEC=spec, term=term))
    assert own is not None
    record = records()[0]
    np.testing.assert_allclose(added(own, record, np.array([2.0])), 2.0 * record.place**3)


def test_the_library_has_effects_of_every_invariance() -> None:
    assert {m.SPEC.breaks.invariance for m in library() if m.SPEC.breaks} == set(Invariance)


def test_what_an_effect_is_alike_is_an_effect() -> None:
    assert {a for m in library() if m.SPEC.breaks for a in m.SPEC.breaks.alike} <= set(names("effect"))


@pytest.mark.parametrize("name", BREAKING)
def test_what_an_effect_breaks_is_shown_as_text(name: str) -> None:
    breaks = load("effect", name).SPEC.breaks
    assert breaks is not None
    assert json.loads(json.dumps(asdict(breaks)))["invariance"] == breaks.invariance.value


def test_what_a_moved_current_adds_is_told_at_currents_that_the_law_was_fitted_at() -> None:
    rows, play = records(), effect("residual-magnetism")
    setting = setting_of(rows, none(rows).terms, [play, effect("current-lag")], STANDARD)
    law = np.ones(setting.law(0, {}).ends[-1])
    # a held current of 1 A, which the field of a play of 0.2 A never reaches: what 1 A would make is not known
    (held,) = (at for at, r in enumerate(rows) if r.condition == "condition 1")
    made = contribution(setting, {play.name: np.array([0.2])}, play.name, law)
    np.testing.assert_array_equal(made[held], 0.0)
    # a lag reaches all currents: what it adds is the difference of the forces
    state = {"current-lag": np.array([0.05, 0.0])}
    forces = [force_of_law(setting, 2, s, law) for s in (state, {})]
    made = contribution(setting, state, "current-lag", law)
    np.testing.assert_allclose(made[2], setting.row_means(2, forces[0] - forces[1]), atol=1e-9)
    assert np.max(np.abs(made[2])) > 0.1
