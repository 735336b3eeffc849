import re
from dataclasses import replace

import pytest

from mrfit.core import registry
from mrfit.io.schemas.fit import Quantity
from mrfit.report.source import read_source
from mrfit.report.symbols import derived_symbol, symbols_of, typeset
from mrfit.report.tables import fit_tex
from mrfit.simulate.current_dependence import CurrentDependence, base_name, node_of


@pytest.mark.parametrize(
    ("name", "symbol"),
    [
        ("kappa", r"\kappa"),
        ("Lc", "L_{c}"),
        ("c0", "c_{0}"),
        ("n", "n"),
        ("C_inf", r"C_\infty"),
        ("fy", "f_{y}"),
        ("g_yield", r"g_\mathrm{yield}"),
        ("Omega", r"\Omega"),
        ("sigma2", r"\sigma_{2}"),
        ("a12", "a_{12}"),
        ("yield_force", ""),
    ],
)
def test_names_spell_symbols(name, symbol):
    assert typeset(name) == symbol


def test_every_parameter_of_the_library_has_a_symbol():
    specs = [registry.load("model", n).SPEC for n in registry.names("model")]
    specs += [registry.load("effect", n).SPEC for n in registry.names("effect")]
    without = [(s.name, p.name) for s in specs for p in s.params if not (p.symbol or typeset(p.name))]
    assert len(specs) > 30 and without == []
    for spec in specs:
        symbols = [p.symbol or typeset(p.name) for p in spec.params]
        assert len(set(symbols)) == len(symbols), spec.name


def test_symbols_of_a_fit_with_effects_are_told_apart(damper):
    fit = read_source(damper[0], ()).fits[0]
    names = ["c", "gas-spring.c", "gas-spring.k_g", "resistance-error.dR", "C_inf@0.5A", "C_inf@1A"]
    values = [Quantity(name=n, value=1.0) for n in names]
    fit = replace(fit, model="tanh+gas-spring+resistance-error", results=[replace(fit.results[0], parameters=values)])
    found = symbols_of(fit)
    assert found["c"] == "$c$" and found["gas-spring.c"] == r"$c^\mathrm{gas~spring}$"
    assert found["gas-spring.k_g"] == "$k_{g}$" and found["resistance-error.dR"] == r"$\Delta R$"
    assert found["C_inf@0.5A"] == found["C_inf"] == r"$C_\infty$"
    assert derived_symbol("C_inf.i2", found) == r"$C_\infty^{(2)}$"
    assert derived_symbol("slope_x", found) == r"slope\_x"


def test_values_on_both_sides_of_a_jump_are_one_parameter_in_two_columns(damper):
    fit = read_source(damper[0], ()).fits[0]
    names = ["fy@0A", "fy@0.2A-", "fy@0.2A+", "fy@2A"]
    values = [
        Quantity(name=n, value=float(k + 1), low=k + 0.9, high=k + 1.1, unit="N", text="force at 0.2 A")
        for k, n in enumerate(names)
    ]
    fit = replace(fit, model="tanh", results=[replace(fit.results[0], parameters=values)])
    found = symbols_of(fit)
    assert found["fy@0.2A-"] == found["fy@0.2A+"] == found["fy"] == "$f_{y}$"
    table = fit_tex(fit)
    assert "$0.2^{-}$\\,A & $0.2^{+}$\\,A" in table
    # nothing collides, no value is lost
    (row,) = [line for line in table.splitlines() if line.startswith("$f_{y}$")]
    assert re.findall(r"mrfitvalue\{(\d)", row) == ["1", "2", "3", "4"]


@pytest.mark.parametrize("orders", ["2", "1/0.7/2", "1:0.7:2", "0/0.00001/1"])
def test_names_of_nodes_are_read_as_they_are_written(orders):
    dependence = CurrentDependence((("fy", orders),), -0.00547, 2.805)
    labels = dependence.labels(orders)
    nodes = [node_of(f"fy@{label}") for label in labels]
    assert [n.current for n in nodes] == pytest.approx(dependence.nodes(orders), rel=1e-3)
    assert [n.side for n in nodes] == [{"-": -1, "+": 1}.get(label[-1], 0) for label in labels]
    assert {base_name(f"gas-spring.k@{label}") for label in labels} == {"gas-spring.k"}
    assert node_of("fy") is None and node_of("fy@x") is None
