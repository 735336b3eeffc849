"""Which form of an effect of temperature a fit keeps, on dampers whose true form is known."""

from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest

import mrfit
from mrfit.core import registry
from mrfit.errors import ConfigError
from mrfit.fit.forms import _settings, with_forms
from mrfit.settings.fit import Settings

FY, C, DT = 400.0, 900.0, 4e-3
NOISE = 2.0


def heated(alpha: Callable[[np.ndarray], np.ndarray], ends: tuple[float, float], seed: int) -> list[mrfit.Recording]:
    """Two sines of a tanh damper that warms steadily, whose force is alpha(T) times that at 25 degC."""
    rng, time = np.random.default_rng(seed), np.arange(3000) * DT
    made = []
    for k, frequency in enumerate((1.0, 2.0)):
        warm = np.linspace(*ends, len(time)) if k == 0 else np.linspace(*ends[::-1], len(time))
        rate = 2.0 * np.pi * frequency
        x, v = 0.01 * np.sin(rate * time), 0.01 * rate * np.cos(rate * time)
        force = alpha(warm) * (FY * np.tanh(60.0 * v) + C * v) + 10.0 + NOISE * rng.standard_normal(len(time))
        columns = {"time (s)": time, "displacement (m)": x, "velocity (m/s)": v, "temperature (degC)": warm}
        made.append(mrfit.Recording.from_frame(pd.DataFrame(columns | {"force (N)": force})))
    return made


def fitted(recordings: list[mrfit.Recording], **options: object) -> mrfit.FitResult:
    fixed = {"a2": 0.0, "k": 0.0}
    common = {"per": "all", "holdout": "none", "fixed": fixed, "model": "tanh+temperature", "forms": "evidence"}
    return mrfit.fit(recordings, **(common | options))


def cubic(t: np.ndarray) -> np.ndarray:
    u = (t - 25.0) / 50.0
    return 1.0 - 0.3 * u + 0.5 * u**2 - 0.4 * u**3


LAWS = {
    "exponential": (lambda t: np.exp(-0.02 * (t - 25.0)), "tanh+temperature"),
    "polynomial of order 1": (lambda t: 1.0 - 0.3 * (t - 25.0) / 50.0, "tanh+temperature-polynomial"),
    "polynomial of order 3": (cubic, "tanh+temperature-polynomial"),
}


@pytest.mark.parametrize(
    ("form", "seed"),
    [("polynomial of order 3", 1), *(pytest.param(f, s, marks=pytest.mark.slow) for f in LAWS for s in (0, 2))],
)
def test_the_true_form_is_kept_and_said(form: str, seed: int) -> None:
    alpha, model = LAWS[form]
    fit = fitted(heated(alpha, (-15.0, 75.0), seed), seed=seed)
    choice = fit.content.form_choice
    assert choice is not None and choice.chosen == form and fit.model == model
    # what is kept predicts bands left out about as well as a fit to them
    error = next(t.error for t in choice.tried if t.form == form)
    assert error is not None and 0.9 < error < 1.1
    assert form in choice.text[0] and all(t.form in choice.text[0] for t in choice.tried)
    assert fit.metrics["rmse"].iloc[-1] == pytest.approx(NOISE, rel=0.1)


@pytest.mark.slow
def test_two_forms_that_serve_alike_leave_the_one_of_fewer_parameters() -> None:
    choice = fitted(heated(lambda t: 1.0 - 0.3 * (t - 25.0) / 50.0, (-15.0, 75.0), 3)).content.form_choice
    assert choice is not None
    size = {t.form: t.parameters for t in choice.tried}
    assert size == {
        "exponential": 2,
        "polynomial of order 1": 1,
        "polynomial of order 2": 2,
        "polynomial of order 3": 3,
    }
    assert choice.chosen == "polynomial of order 1"


def test_tests_at_one_temperature_leave_the_form_that_is_named_and_say_so() -> None:
    fit = fitted(heated(lambda t: np.ones_like(t), (40.0, 40.2), 4))
    assert fit.model == "tanh+temperature"
    assert [w.kind for w in fit.content.warnings if "form" in w.kind] == ["forms-untested"]


def test_without_asking_the_form_is_the_one_named() -> None:
    fit = fitted(heated(cubic, (-15.0, 75.0), 5), forms="named")
    assert fit.content.form_choice is None and fit.model == "tanh+temperature"


@pytest.mark.parametrize(("options", "said"), [({"model": "tanh"}, "temperature"), ({"per": "condition"}, "--per all")])
def test_a_choice_that_cannot_be_made_is_refused(options: dict[str, object], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        fitted(heated(cubic, (20.0, 60.0), 6), **options)


def test_a_form_takes_the_place_of_its_effect_beside_a_mass_too() -> None:
    model = "bingham+temperature@force-displacement"
    spec = with_forms(model)
    assert spec is registry.load("effect", "temperature").SPEC
    other = next(f for f in spec.forms if f.effect != spec.name)
    asked = _settings(Settings(model, forms="evidence", per="all"), spec, other)
    assert asked.model == f"bingham+{other.effect}@force-displacement"
