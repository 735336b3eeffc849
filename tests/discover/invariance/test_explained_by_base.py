"""What a base has itself, found in its own terms and not by its name."""

from dataclasses import replace

import numpy as np
import pytest

from mrfit.core.registry import load
from mrfit.discover.invariance.base import Base, base_of, none
from mrfit.discover.invariance.explained_by_base import explained, lawful, owns, strength_in
from mrfit.discover.invariance.sensitivity import ExaminedEffect, examined
from mrfit.discover.invariance.setting import setting_of
from mrfit.discover.invariance.weights import equal
from mrfit.discover.policy import STANDARD
from mrfit.simulate.assembly import assemble
from mrfit.simulate.current_dependence import CurrentDependence
from tests.discover.invariance.specimens import records


def effect(name: str) -> ExaminedEffect:
    found = examined(load("effect", name))
    assert found is not None
    return found


def base(name: str) -> Base:
    assembly = assemble(name)
    return base_of(assembly, assembly.spec.start, records())


@pytest.mark.parametrize(
    ("model", "name", "owned"),
    [
        ("bingham", "gas-spring", False),
        ("bingham", "force-offset", True),
        ("guo", "gas-spring", False),
        ("tanh", "gas-spring", True),
        ("boucwen", "gas-spring", True),
        ("boucwen", "force-offset", True),
        ("hysteretic-biviscous", "inertia", False),
        ("spencer", "gas-spring", True),
        ("tanh", "inertia", False),
    ],
)
def test_a_base_owns_the_forces_in_the_span_of_its_linear_terms(model: str, name: str, owned: bool) -> None:
    assert owns(base(model), records(), effect(name), STANDARD) is owned


def test_a_spring_that_is_at_rest_elsewhere_is_the_base_s() -> None:
    rows = records()
    shifted = [replace(r, channels={**r.channels, "displacement": r.place + 0.05}) for r in rows]
    assert owns(Base(tuple(r.place[:, None] for r in rows)), shifted, effect("gas-spring"), STANDARD)


def test_a_term_that_ties_a_spring_to_a_damping_is_left_out() -> None:
    rows = records()
    law = setting_of(rows, none(rows).terms, [], STANDARD)
    forces = [law.law(k, {}).values for k in range(len(rows))]
    place, speed = (np.concatenate([r.channels[n] for r in rows]) for n in ("displacement", "velocity"))
    tied = [(r.speed + 2.0 * r.place)[:, None] for r in rows]
    kept = [np.tanh(r.speed / 0.01)[:, None] for r in rows]
    both = Base(tuple(np.hstack([a, b]) for a, b in zip(tied, kept, strict=True)))
    found = lawful(both, rows, [effect("gas-spring")], forces)
    assert found.terms[0].shape[1] == 1
    np.testing.assert_array_equal(found.terms[0], kept[0])
    assert explained(speed[:, None], speed + 2.0 * place) < 1.0


@pytest.mark.parametrize(("omega", "stiffness"), [(2.0, 2600.0), (0.5, 650.0), (0.0, 0.0)])
def test_the_strength_of_an_effect_in_a_model_is_what_its_law_ties_to_others(omega: float, stiffness: float) -> None:
    """Guo's law holds C_inf*(v + Omega*x), which is a damper with a spring of C_inf*Omega beside it."""
    rows, assembly = records(), assemble("guo")
    drives = [np.stack([r.channels[n] for n in assembly.spec.inputs]) for r in rows]
    theta = np.array([[300.0, 1300.0, 60.0, omega, 0.0]])
    own = setting_of(rows, none(rows).terms, [effect("gas-spring")], STANDARD)
    forces = [assembly.simulate(d, theta, r.dt)[0] for d, r in zip(drives, rows, strict=True)]
    output = [own.row_means(k, f) / own.scales.span for k, f in enumerate(forces)]
    # any law takes a little of a spring, and gives a little
    assert strength_in(own, equal(own), own.known["gas-spring"], output) == pytest.approx(
        stiffness, rel=0.15, abs=100.0
    )


@pytest.mark.parametrize("share", [0.9991, 0.9989])
def test_what_a_base_owns_is_a_matter_of_the_share_explained(share: float) -> None:
    rows = records()
    place = np.concatenate([r.place for r in rows])
    noise = np.random.default_rng(0).standard_normal(len(place))
    noise -= place * (noise @ place) / (place @ place)
    noise *= np.sqrt((1.0 - share) / share * (place @ place) / (noise @ noise))
    whole = np.split(place + noise, np.cumsum([len(r.place) for r in rows])[:-1])
    own = Base(tuple(w[:, None] for w in whole))
    assert owns(own, rows, effect("gas-spring"), STANDARD) is (share > STANDARD.owned)


def test_terms_of_a_base_do_not_follow_the_current() -> None:
    assembly = assemble("bingham", CurrentDependence((("fy", 1),), 0.0, 1.0))
    theta = assembly.spec.start
    rows = records()
    found = base_of(assembly, theta, rows)
    stepped = next(k for k, r in enumerate(rows) if r.moves)
    sliding = np.abs(rows[stepped].speed) > 0.01
    friction = found.terms[stepped][sliding, 0]
    assert np.ptp(np.abs(friction)) < 1e-3 * np.max(np.abs(friction))
    assert np.ptp(found.response[stepped]) > 0.0
