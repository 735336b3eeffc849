"""The engine knows no effect and no channel by name: a plug-in's effect or channel is treated as the built-in ones are.

What it needs to know of an effect or a model stands in its SPEC, of a channel in ``mrfit/core/channels.py``.
"""

import ast

import pytest

from mrfit.core import registry
from mrfit.core.channels import CHANNELS
from tests.test_layers import modules

ENGINE = ("discover/", "fit/", "search/", "signal/", "optimizers/")
# File and name -> why it may say it
ALLOWED = {
    (
        "discover/writing/regions.py",
        "displacement",
    ): "regions are told to people in words that only suit this channel: end of stroke",
    ("discover/writing/regions.py", "velocity"): "pre-yield, post-yield, rebound",
    ("discover/writing/regions.py", "angular_velocity"): "held-out tests that go faster",
    ("discover/writing/regions.py", "current"): "after a step of the current",
    ("discover/writing/regions.py", "temperature"): "cold and hot third; the channel, not the effect of this name",
    ("fit/select.py", "velocity"): "`--only MH` is defined by peak velocity",
    ("fit/select.py", "displacement"): "from which it is derived",
    ("fit/diagnostics/identifiability.py", "inertia"): "a role of parameters, not the effect of this name",
    ("fit/predict.py", "current"): "a key of fit.json",
    ("fit/stage.py", "current"): "a key of fit.json",
    ("fit/diagnostics/diagnose.py", "flux"): "the integral of a voltage, to which an effect may add",
    ("fit/diagnostics/diagnose.py", "voltage"): "which has no range of its own where a flux is the output",
    ("search/staged.py", "velocity"): "the kind of test `constant-speed` is told by it",
    ("search/staged.py", "temperature"): "the kind of test `heating` is told by it",
}


def known() -> set[str]:
    return {*registry.names("effect"), *CHANNELS}


def said(tree: ast.AST) -> set[str]:
    """Return the names of effects and channels that stand as strings in a syntax tree."""
    return {n.value for n in ast.walk(tree) if isinstance(n, ast.Constant) and isinstance(n.value, str)} & known()


def test_the_engine_says_what_is_allowed_and_no_other_name_of_an_effect_or_a_channel() -> None:
    found = {(place, name) for place, tree in modules() if place.startswith(ENGINE) for name in said(tree)}
    assert found - set(ALLOWED) == set(), "let the SPEC or core/channels.py say it"
    assert set(ALLOWED) <= found


@pytest.mark.parametrize(
    ("code", "names"),
    [
        ('if name == "temperature": pass', {"temperature"}),
        ('x = spec.output == "flux"', {"flux"}),
        ('if "delay" in effects: pass', {"delay"}),
        ('text = "the temperature does not move"', set()),
        ('"""Of the delay."""', set()),
    ],
)
def test_a_name_in_code_is_seen_and_a_sentence_is_not(code: str, names: set[str]) -> None:
    assert said(ast.parse(code)) == names
