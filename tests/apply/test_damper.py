"""Dampers of known parameters: from names with every digit of a current comes the same model."""

import csv
import io
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrfit.apply.damper import Damper, damper
from mrfit.apply.page import facts_of
from mrfit.errors import ConfigError, DataError
from mrfit.io.csv_table import csv_table
from mrfit.io.schemas.fit import PARAMETER_COLUMNS, Fit, FitDependence, Quantity, Result
from mrfit.models import tanh
from mrfit.simulate.assembly import assemble
from mrfit.simulate.current_dependence import CurrentDependence
from mrfit.simulate.current_levels import exact_parameters
from tests.apply.dampers import paper_tanh

ORDERS = st.sampled_from([1, 2, 3, "log2", "sat1", "1:0.5:1", "1/0.5/2"])


def fit_of(orders: dict[str, int | str], ends: tuple[float, float], rng: np.random.Generator) -> Fit:
    """Return a fit of tanh with parameters that depend on current."""
    spec = assemble("tanh", CurrentDependence(tuple(orders.items()), *ends)).spec
    values = [Quantity(name=p.name, value=p.start * rng.uniform(0.5, 1.5)) for p in spec.params]
    dependence, result = (
        FitDependence(orders=orders, low=ends[0], high=ends[1]),
        Result(condition="all", parameters=values, evaluations=0),
    )
    common = {"name": "x", "model": "tanh", "optimizer": "auto", "output": "force", "metrics": []}
    return Fit(**common, current_dependence=dependence, results=[result])


@given(order=ORDERS, other=ORDERS, low=st.floats(0.0, 0.4), more=st.floats(0.2, 3.0), seed=st.integers(0, 99))
@settings(max_examples=60, deadline=None)
def test_a_fits_table_of_parameters_rebuilds_its_model(
    order: int | str, other: int | str, low: float, more: float, seed: int
) -> None:
    fit = fit_of({"fy": order, "c": other}, (low, 0.5 + more), np.random.default_rng(seed))
    table = csv.DictReader(
        io.StringIO(
            csv_table(
                PARAMETER_COLUMNS, [{"condition": c, "parameter": p.name, **vars(p)} for c, p in exact_parameters(fit)]
            )
        )
    )
    found = damper("tanh", {row["parameter"]: float(row["value"]) for row in table}, {"fy": order, "c": other})
    assert (found.low, found.high) == (low, 0.5 + more)
    known = tuple((p.name, p.value) for p in fit.results[0].parameters)
    assert found == Damper("tanh", "tanh", known, (("fy", order), ("c", other)), low, 0.5 + more)


def test_short_names_of_nodes_need_the_range_of_currents() -> None:
    values = {p.name: p.start for p in tanh.SPEC.params}
    yields = {"fy@0.2A": 10.0, "fy@1.005A": 900.0}
    own = {n: v for n, v in values.items() if n != "fy"} | yields
    assert damper("tanh", own, {"fy": 1}).high == 1.005
    found = damper("tanh", own, {"fy": 1}, (0.2, 1.00475))
    assert replace(found, high=1.005) == damper("tanh", own, {"fy": 1})
    with pytest.raises(ConfigError, match="no parameter 'fy@0.3A'"):
        damper("tanh", own | {"fy@0.3A": 1.0}, {"fy": 1})


def test_the_facts_of_a_page_have_the_equations_of_effects() -> None:
    lag = paper_tanh(**{"current-lag.tau": 0.02, "current-lag.t_d": 0.0})
    plain, lagged = (dict(facts_of(one))["Equation"] for one in (paper_tanh(), lag))
    assert lagged == f"{plain}; current-lag: d(i_sim)/dt = (i(t - t_d) - i_sim)/tau"


@pytest.mark.parametrize("model", ["bingham@force-displacement", "bingham+gas-spring@force-displacement"])
def test_a_mass_is_refused_with_and_without_an_effect(model: str) -> None:
    with pytest.raises(DataError, match=r"predicts displacement: apply takes models of force or torque"):
        damper(model, {"fy": 1.0, "C_inf": 2.0, "f0": 0.0, "mass": 1.0})
