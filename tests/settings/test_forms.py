"""What people write otherwise than its type says: on the command line, in TOML and in Python, right and wrong."""

from pathlib import Path
from typing import Any

import pytest

from mrfit.core.setting import SettingForm
from mrfit.errors import ConfigError
from mrfit.settings import forms
from mrfit.settings.compare import CompareOptions, OfOptimizers
from mrfit.settings.compare import Settings as Comparison

BOUNDS, FIXED = ["fy=1:500", " c = 2:3"], ["fy=1", "c=2.5"]


@pytest.mark.parametrize(
    ("form", "written", "value"),
    [
        (forms.NUMBERS, FIXED, (("fy", 1.0), ("c", 2.5))),
        (forms.CONSTANTS, ["F=0.7,CR=0.9", "mwoa.b=1.2"], (("F", 0.7), ("CR", 0.9), ("mwoa.b", 1.2))),
        (forms.LIMITS, BOUNDS, (("fy", 1.0, 500.0), ("c", 2.0, 3.0))),
        (forms.NUMBERS, ["a=1,b.c=-2", "d=3"], (("a", 1.0), ("b.c", -2.0), ("d", 3.0))),
        (forms.LIMITS, ["a=1:2,b=3:4"], (("a", 1.0, 2.0), ("b", 3.0, 4.0))),
        (forms.TEXTS, ["site=Torino", "press=MTS 810"], (("site", "Torino"), ("press", "MTS 810"))),
        (forms.NAMES, "tanh, dahl", ("tanh", "dahl")),
        (forms.NAMES, "", ()),
        (forms.LISTED, ["a", "b"], ("a", "b")),
        (forms.LISTED, None, ()),
        (forms.NUMBERS, None, ()),
        (forms.OHMS, "2.5", 2.5),
        (forms.OHMS, "auto", "auto"),
        (forms.OHMS, None, None),
        (forms.ORDER_FORM, "fy=2", "fy=2"),
        (forms.SIZE, "2GB", 2e9),
        (forms.SIZE, None, None),
    ],
)
def test_an_option_as_it_is_written(form: SettingForm, written: Any, value: object) -> None:
    assert form.parse("--x", written) == value


@pytest.mark.parametrize(
    ("form", "table", "value"),
    [
        (forms.NUMBERS, {"fy": 1.0}, (("fy", 1.0),)),
        (forms.CONSTANTS, {"F": 0.7, "mwoa": {"b": 1.2, "c": 3.0}}, (("F", 0.7), ("mwoa.b", 1.2), ("mwoa.c", 3.0))),
        (forms.LIMITS, {"fy": (1.0, 500.0)}, (("fy", 1.0, 500.0),)),
        (forms.TEXTS, {"site": "Torino"}, (("site", "Torino"),)),
        (forms.NAMES, ["tanh", "dahl"], ("tanh", "dahl")),
        (forms.SIZE, "1.5GiB", 1.5 * 2**30),
        (forms.SIZE, None, None),
        (forms.PATH, "a/b", Path("a/b")),
        (forms.PATH, None, None),
        (forms.ORDER_FORM, 2, "2"),
        (forms.NUMBER_OR_WORD, 2.5, "2.5"),
    ],
)
def test_the_same_in_toml(form: SettingForm, table: Any, value: object) -> None:
    assert form.load(table) == value


@pytest.mark.parametrize(
    ("form", "given", "value"),
    [
        (forms.NUMBERS, {"fy": 1}, (("fy", 1.0),)),
        (forms.CONSTANTS, {"mwoa": {"b": 1}}, (("mwoa.b", 1.0),)),
        (forms.LIMITS, {"fy": [1, 500]}, (("fy", 1.0, 500.0),)),
        (forms.TEXTS, {"site": 3}, (("site", "3"),)),
        (forms.NAMES, "tanh,dahl", ("tanh", "dahl")),
        (forms.NAMES, ("tanh", " dahl"), ("tanh", "dahl")),
        (forms.OHMS, 2, 2.0),
        (forms.OHMS, "auto", "auto"),
        (forms.OHMS, None, None),
        (forms.ORDER_FORM, {"fy": 2, "c": "1/0.2/2"}, "fy=2,c=1/0.2/2"),
        (forms.ORDER_FORM, 2, "2"),
        (forms.NUMBER_OR_WORD, 2, "2.0"),
        (forms.NUMBER_OR_WORD, "free", "free"),
        (forms.SIZE, "500MB", 5e8),
        (forms.SIZE, 1e9, 1e9),
        (forms.SIZE, None, None),
        (forms.PATH, "a", Path("a")),
        (forms.PATH, "", None),
    ],
)
def test_the_same_in_python(form: SettingForm, given: Any, value: object) -> None:
    assert form.take("x", given) == value


@pytest.mark.parametrize(
    ("form", "written", "said"),
    [
        (forms.NUMBERS, ["fy"], "--x takes NAME=VALUE, not 'fy'"),
        (forms.NUMBERS, ["=1"], "--x takes NAME=VALUE, not '=1'"),
        (forms.NUMBERS, ["fy=a"], "--x: 'a' is not a number"),
        (forms.NUMBERS, ["fy=inf"], "--x: 'inf' is not finite"),
        (forms.LIMITS, ["fy=1"], "--x takes NAME=LOW:HIGH, not 'fy=1'"),
        (forms.OHMS, "two", "--resistance takes a number of ohms or 'auto', not 'two'"),
        (forms.OHMS, "-1", "--resistance must be a positive number of ohms, not -1"),
        (forms.OHMS, "inf", "--resistance must be a positive number of ohms, not inf"),
        (forms.SIZE, "much", "--max-memory takes a size such as 500MB or 2GB, not 'much'"),
        (forms.SIZE, "0GB", "--max-memory takes a size such as 500MB or 2GB, not '0GB'"),
        (forms.SIZE, "1IB", "--max-memory takes a size such as 500MB or 2GB, not '1IB'"),
    ],
)
def test_a_wrong_option_says_what_it_takes(form: SettingForm, written: Any, said: str) -> None:
    with pytest.raises(ConfigError) as found:
        form.parse("--x", written)
    assert str(found.value) == said


@pytest.mark.parametrize(
    ("form", "given", "said"),
    [
        (forms.NUMBERS, "fy=1", "x takes a dictionary of names and numbers, not 'fy=1'"),
        (forms.NUMBERS, {"fy": "much"}, "x fy takes a number, not 'much'"),
        (forms.NUMBERS, {"fy": float("nan")}, "x fy: nan is not finite"),
        (forms.CONSTANTS, 3, "x takes a dictionary of names and numbers, not 3"),
        (forms.LIMITS, [1, 2], "x takes a dictionary of names and (low, high), not [1, 2]"),
        (forms.LIMITS, {"fy": 1}, "x fy takes (low, high), not 1"),
        (forms.LIMITS, {"fy": "12"}, "x fy takes (low, high), not '12'"),
        (forms.TEXTS, 3, "x takes a dictionary of names and texts, not 3"),
        (forms.NAMES, 3, "x takes names, not 3"),
        (forms.NUMBER_OR_WORD, [1.0], "x takes a number, not [1.0]"),
        (forms.PATH, 3, "x takes a path, not 3"),
        (forms.PATH, "a\0b", "x takes a path, not 'a\\x00b'"),
    ],
)
def test_a_wrong_argument_says_what_it_takes(form: SettingForm, given: Any, said: str) -> None:
    with pytest.raises(ConfigError) as found:
        form.take("x", given)
    assert str(found.value) == said


@pytest.mark.parametrize(
    ("given", "name"),
    [
        ({}, "tanh.auto.all"),
        ({"per": "condition"}, "tanh.auto"),
        ({"only": "MH"}, "tanh.auto.all.MH"),
        ({"seed": 3, "weight": "floor"}, "tanh.auto.all.seed-3.weight-floor"),
        ({"options": (("population", 40.0), ("F", 0.7))}, "tanh.auto.all.options-population40_F0.7"),
        ({"only": "sine-*"}, "tanh.auto.all.sine-_"),
        ({"jobs": 4}, "tanh.auto.all"),
    ],
)
def test_the_fit_of_a_comparison_is_named_after_what_it_sets_otherwise(given: dict[str, Any], name: str) -> None:
    settings = Comparison(**given)
    assert settings.name_of("tanh") == name == settings.of_fit("tanh").name


def test_long_names_of_fits_are_cut_and_stay_apart() -> None:
    names = {Comparison(only="x" * 120 + end).name_of("tanh") for end in "ab"}
    assert len(names) == 2 and {len(n) for n in names} == {100}


def test_models_are_those_written_each_once_or_all_there_are() -> None:
    assert Comparison(models=("tanh", "dahl", "tanh")).names == ["tanh", "dahl"]
    assert {"tanh", "boucwen-flux"} <= {*Comparison().names}


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"models": ("tanh",), "optimizers": ("lsq",)},
        {"optimizers": ("lsq",)},
        {"models": ("tanh",), "model": "tanh"},
        {"models": ("tanh",), "bounds": (("fy", 0.0, 1.0),)},
    ],
)
def test_a_comparison_is_of_models_or_of_optimizers(given: dict[str, Any]) -> None:
    with pytest.raises(ConfigError, match="--models|--optimizers"):
        CompareOptions(**given)


def test_options_become_the_settings_of_the_comparison_asked_for() -> None:
    models = CompareOptions(models=("tanh",), seed=3, per="condition")
    assert models.of_models == Comparison(models=("tanh",), seed=3, per="condition")
    found = CompareOptions(optimizers=("lsq", "pso"), model="tanh", bounds=(("fy", 0.0, 1.0),), seed=9).of_optimizers
    assert isinstance(found, OfOptimizers) and found.optimizers == ("lsq", "pso") and found.seeds == 5
    assert (found.fit.model, found.fit.bounds, found.fit.seed) == ("tanh", (("fy", 0.0, 1.0),), 0)
