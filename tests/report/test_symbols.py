from dataclasses import replace

import pytest

from mrfit.core import registry
from mrfit.io.schemas.fit import Quantity
from mrfit.report.source import read_source
from mrfit.report.symbols import derived_symbol, symbols_of, typeset


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
