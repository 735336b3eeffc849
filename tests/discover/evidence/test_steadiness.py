"""Growth of a strength over records, planted in the errors of a model that is linear in it."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.discover.evidence.refit import Fitter, Refit
from mrfit.discover.evidence.steadiness import growths

LENGTHS, DT, FLOORS = (400, 300), (0.01, 0.02), (2.0, 5.0)
TIME = np.concatenate([np.linspace(-1.0, 1.0, n) for n in LENGTHS])


def planted(growth: float, jacobian: Array, noise: float = 0.0) -> tuple[Fitter, Refit]:
    """Return a model without a growth that its first parameter has over every record."""
    rng = np.random.default_rng(3)
    errors = -growth * jacobian[:, 0] * TIME + noise * rng.standard_normal(len(TIME))
    # as a fit ends: nothing is left for the parameters that do not grow
    errors -= jacobian @ np.linalg.lstsq(jacobian, errors, rcond=None)[0]
    point = np.full(jacobian.shape[1], 0.5)

    def residuals(assembly: Any, cube: Any) -> Any:
        return lambda points: errors + (points - point) @ jacobian.T

    stretches = [
        SimpleNamespace(segment=SimpleNamespace(samples=n), block=SimpleNamespace(dt=dt), floor=floor)
        for n, dt, floor in zip(LENGTHS, DT, FLOORS, strict=True)
    ]
    fitter = SimpleNamespace(residuals=residuals, bench=SimpleNamespace(of_role=lambda role: stretches))
    parts = np.split(errors, [LENGTHS[0]])
    fit = SimpleNamespace(assembly=None, cube=None, point=point, train=parts, distances=lambda name: {0: 0.3})
    return cast(Fitter, fitter), cast(Refit, fit)


WAVES = np.column_stack([np.sin(np.arange(len(TIME)) / 7.0), np.cos(np.arange(len(TIME)) / 11.0)])


@pytest.mark.parametrize("growth", [0.2, -0.05])
def test_a_growth_that_was_planted_is_found_with_its_sign_beside_all_that_the_model_fits(growth: float) -> None:
    (found,) = growths(*planted(growth, WAVES), "inertia")
    assert found.change == pytest.approx(growth, rel=1e-4)
    assert found.distance == 0.3
    # RMS of what the growth moves the output by at a record's end, over half the record
    parts = np.split(growth * WAVES[:, 0], [LENGTHS[0]])
    rates = [
        np.sqrt(np.mean(p**2)) * floor / (0.5 * n * dt)
        for p, n, dt, floor in zip(parts, LENGTHS, DT, FLOORS, strict=True)
    ]
    assert found.rates == pytest.approx(rates, rel=1e-4)


def test_white_noise_spreads_a_growth_as_least_squares_says() -> None:
    changes, spreads = [], []
    jacobian = WAVES
    for scale in (0.5, 1.0):
        (found,) = growths(*planted(0.0, jacobian, scale), "inertia")
        free = jacobian[:, 0] * TIME
        basis = np.linalg.qr(jacobian)[0]
        free = free - basis @ (basis.T @ free)
        spreads.append(found.spread / (scale / np.sqrt(free @ free)))
        changes.append(abs(found.change) / found.spread)
    assert spreads == pytest.approx([1.0, 1.0], rel=0.3)
    assert max(changes) < 4.0


def test_an_effect_that_may_change_within_a_record_has_no_growth() -> None:
    assert growths(*planted(0.2, WAVES), "temperature") == ()


def test_a_strength_of_which_growth_is_what_the_model_fits_has_none() -> None:
    grows = WAVES[:, 0] * TIME
    assert growths(*planted(0.0, np.column_stack([WAVES[:, 0], grows])), "inertia") == ()
