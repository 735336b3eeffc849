"""An eddy current's circuit is an equation only where the static flux rises with the current: a fit says where not."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from mrfit.fit.diagnostics.diagnose import law_warnings, slope_warnings
from mrfit.simulate.assembly import assemble

MODEL = assemble("boucwen-flux+eddy-current")
WITH_ERROR = assemble("boucwen-flux+eddy-current+resistance-error")
DT = 1e-3
# current up and down, with small loops on the way
CURRENT = np.convolve(np.sin(0.02 * np.arange(3000)) + 0.3 * np.sin(0.17 * np.arange(3000)), np.ones(5) / 5, "valid")


def said(divisor: float, conductance: float, error: float = 0.0) -> list[str]:
    model = WITH_ERROR if error else MODEL
    names = model.spec.names
    known = {"A": 1.2, "Lc": 0.02, "kappa": 3.5, "beta": 3.0, "gamma": 6.0, "n": 1.3, "D": divisor}
    theta = np.array([{**known, "eddy-current.G": conductance, "resistance-error.dR": error}[n] for n in names])
    part = SimpleNamespace(block=SimpleNamespace(drive=CURRENT[None]), dt=DT)
    return [f"{c.kind}: {c.text}" for c in slope_warnings([cast(Any, part)], model, theta)]


@pytest.mark.parametrize(("divisor", "found"), [(1 / 20, True), (1 / 5, True), (2.0, False), (20.0, False)])
def test_a_flux_that_falls_while_the_current_rises_is_said(divisor: float, found: bool) -> None:
    # steepest at a turn, where dz/di is kappa + (gamma - beta)*z^n at most: A*Lc + (1 - A)*Lc/D*dz/di
    text = " ".join(said(divisor, 0.1))
    assert ("falling-output: flux falls while current rises" in text) is found


def test_its_size_is_that_of_the_law_and_without_eddy_currents_there_is_no_circuit() -> None:
    base, theta = assemble("boucwen-flux"), np.array([[1.2, 0.02, 3.5, 3.0, 6.0, 1.3, 1 / 20]])
    slope = np.diff(base.simulate(CURRENT[None], theta, DT)[0]) / np.diff(CURRENT)
    (text,) = said(1 / 20, 0.1)
    assert f"by up to {-slope.min():.3g} Wb/A, in {100 * np.mean(slope < 0):.2g} % of the samples" in text
    assert said(1 / 20, 0.0) == []


def test_what_an_error_of_the_record_adds_falls_and_is_no_flux_of_the_circuit() -> None:
    theta = np.array([[1.2, 0.02, 3.5, 3.0, 6.0, 1.3, 2.0, 0.1, -2.0]])
    assert np.any(np.diff(WITH_ERROR.simulate(CURRENT[None], theta, DT)[0]) * np.diff(CURRENT) < 0.0)
    assert said(2.0, 0.1, -2.0) == [] and said(1 / 20, 0.1, -2.0) != []


def test_a_parameter_that_is_called_linear_and_is_not_is_named() -> None:
    model = assemble("tanh")
    moved = 0.01 * np.sin(0.02 * np.arange(600))
    drive = np.stack([moved, np.gradient(moved, DT)])
    part = SimpleNamespace(block=SimpleNamespace(drive=drive), dt=DT)
    theta = np.array(model.spec.start)
    for wrong in ((), ("a1",)):
        spec = replace(model.spec, linear=(*model.spec.linear, *wrong))
        found = law_warnings([cast(Any, part)], replace(model, spec=spec), theta)
        assert [c.kind for c in found] == ["not-linear"] * len(wrong)
        assert all("not linear in a1, which" in c.text for c in found)


def test_a_skew_between_probes_is_no_flux_of_the_circuit_either() -> None:
    model = assemble("boucwen-flux+eddy-current+probe-skew")
    drive = np.stack([CURRENT, np.full(len(CURRENT), 2.0)])
    part = SimpleNamespace(block=SimpleNamespace(drive=drive), dt=DT)
    known = {"A": 1.2, "Lc": 0.02, "kappa": 3.5, "beta": 3.0, "gamma": 6.0, "n": 1.3, "D": 2.0, "eddy-current.G": 0.1}
    theta = np.array([{**known, "probe-skew.tau": 1e-3}[n] for n in model.spec.names])
    assert slope_warnings([cast(Any, part)], model, theta) == []
