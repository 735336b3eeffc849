"""An option of a call is a field of a stage's settings: its names, its type, its limits, and its help."""

import inspect
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
import pytest

from mrfit.api.options import canonical, check_names, settings_of, with_options
from mrfit.core.setting import Setting
from mrfit.errors import ConfigError
from mrfit.settings.fit import Settings as FitSettings


@dataclass(frozen=True)
class Given:
    """Settings of a test.

    Attributes
    ----------
    kind
        One of two.
    count
        How many.
    share
        A share.
    """

    model: Annotated[str, Setting("Model.")]
    kind: Annotated[Literal["one", "two"], Setting("One of two.")] = "one"
    count: Annotated[int, Setting("How many.", flag="number", low=1, high=9)] = 2
    share: Annotated[float, Setting("A share.", above=0.0, high=1.0)] = 0.5
    on: Annotated[bool, Setting("Whether.")] = False
    text: Annotated[str, Setting("Text.")] = ""
    least: Annotated[float | None, Setting("Or none.")] = None
    ohms: Annotated[float | Literal["auto"] | None, Setting("Or auto.")] = None
    inner: float = 1.0


def made(**given: object) -> Given:
    return settings_of(Given, given, model="m")


def test_what_is_not_given_has_its_default_and_what_is_decided_is_not_asked_for() -> None:
    assert made() == Given("m") and made(model="other").model == "m"
    assert made(unknown=1) == Given("m")


@pytest.mark.parametrize(
    ("given", "field", "value"),
    [
        ({"kind": "two"}, "kind", "two"),
        ({"count": 3}, "count", 3),
        ({"count": np.int64(3)}, "count", 3),
        ({"number": 3}, "count", 3),
        ({"share": 1}, "share", 1.0),
        ({"share": np.float32(0.25)}, "share", 0.25),
        ({"on": True}, "on", True),
        ({"least": None}, "least", None),
        ({"least": 3}, "least", 3.0),
        ({"ohms": "auto"}, "ohms", "auto"),
        ({"ohms": 2.5}, "ohms", 2.5),
        ({"text": "any"}, "text", "any"),
    ],
)
def test_a_value_of_its_type_is_taken_as_python_s_own(given: dict[str, Any], field: str, value: object) -> None:
    found = getattr(made(**given), field)
    assert found == value and type(found) is type(value)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"kind": "three"}, "kind takes 'one' or 'two', not 'three'"),
        ({"kind": 1}, "kind takes 'one' or 'two', not 1"),
        ({"count": 2.5}, "count takes a whole number, not 2.5"),
        ({"count": "2"}, "count takes a number, not '2'"),
        ({"count": 0}, "count takes 1 or more, not 0"),
        ({"count": 10}, "count takes 9 or less, not 10"),
        ({"share": 0.0}, "share takes a number above 0, not 0"),
        ({"share": 1.5}, "share takes 1 or less, not 1.5"),
        ({"share": None}, "share takes a number, not None"),
        ({"on": "yes"}, "on takes True or False, not 'yes'"),
        ({"text": 3}, "text takes text, not 3"),
    ],
)
def test_another_value_ends_in_one_line(given: dict[str, object], said: str) -> None:
    with pytest.raises(ConfigError) as found:
        made(**given)
    assert str(found.value) == said


def test_both_names_of_one_option_are_one_too_many() -> None:
    assert canonical([Given], {"number": 1}) == {"count": 1} == canonical([Given], {"count": 1})
    with pytest.raises(ConfigError, match="number and count are one option: give one"):
        canonical([Given], {"number": 1, "count": 2})


def test_an_unknown_name_is_told_with_near_ones_or_with_all() -> None:
    check_names([Given], {"number": 1, "share": 0.5})
    with pytest.raises(ConfigError, match="there is no option 'shar': did you mean share"):
        check_names([Given], {"shar": 1})
    with pytest.raises(ConfigError, match="there is no option 'zzz': there are kind, count"):
        check_names([Given], {"zzz": 1}, decided=("model",))
    with pytest.raises(ConfigError, match="no option 'model'"):
        check_names([Given], {"model": "m"}, decided=("model",))


def test_a_function_shows_its_options_in_its_signature_and_help() -> None:
    def called(data: object, *, seed: int = 0, **options: object) -> Given:
        """Do it."""
        return made(**options)

    with_options(called, [Given], ("model",))
    names = list(inspect.signature(called).parameters)
    assert names == ["data", "seed", "kind", "count", "share", "on", "text", "least", "ohms", "inner"]
    assert called.__doc__ and "On the command line ``number``" in called.__doc__ and "A share." in called.__doc__
    assert inspect.signature(called).parameters["count"].default == 2


def test_forms_of_a_fit_take_what_a_notebook_writes() -> None:
    found = settings_of(FitSettings, {"bounds": {"fy": (1, 500)}, "fixed": {"c": 2}, "opt": "lsq"}, model="tanh")
    assert found.bounds == (("fy", 1.0, 500.0),) and dict(found.fixed) == {"c": 2.0}
    assert found.optimizer == "lsq"
