"""What a discovery cannot tell apart is told apart by the test that is advised; intervals shrink as expected."""

import json
from pathlib import Path

import numpy as np
import pytest

import mrfit
from mrfit.io.schemas.advice import AdviceFile
from mrfit.io.schemas.reading import load
from mrfit.io.workspace import plain
from tests.advise.lab import MASS, MODEL, RATE, RIG, SPRING, advised, one_frequency

DRIVES = ("test-1.csv", "companion.csv")


@pytest.mark.parametrize(
    ("truth", "size"), [("inertia", MASS), pytest.param("gas-spring", SPRING, marks=pytest.mark.slow)]
)
def test_the_advised_test_names_what_one_frequency_cannot(truth, size, tmp_path: Path):
    rng = np.random.default_rng([3, len(truth)])
    logs = one_frequency({truth: size}, rng)
    before = mrfit.discover(logs, model=MODEL)
    assert before.verdict == "ambiguous" and {"inertia", "gas-spring"} <= set(before.ambiguous_set)
    advice = mrfit.advise(before, logs, RIG)
    pair = advice.content.pairs[0]
    assert pair.separable and pair.before < 1.0 and advice.content.tests[0].distances[0] > 100.0
    # the law of the criterion: the further from the frequency of the data, the further apart
    assert advice.content.tests[0].numbers["frequency"] > 4.0
    after = mrfit.discover([*logs, *advised(advice, {truth: size}, rng, DRIVES)], model=MODEL)
    assert [e.name for e in after.effects] == [truth]
    assert after.effects[0].parameters[0].value == pytest.approx(size, rel=0.05)
    advice.save(tmp_path)
    stored = load(tmp_path / "advise.json", AdviceFile, "")
    assert stored is not None and stored.text[0].startswith("Run a ")
    assert (stored.tests, stored.pairs) == (advice.content.tests, advice.content.pairs)
    assert plain(stored) == advice.to_json()
    assert {p.name for p in tmp_path.iterdir()} >= {*DRIVES, "loops.png", "loops.svg"}
    rows = np.genfromtxt(tmp_path / "test-1.csv", delimiter=",", skip_header=1)
    assert np.abs(rows[:, 1]).max() <= 0.015 and np.abs(rows[:, 2]).max() <= 0.3
    assert np.diff(rows[:, 0]) == pytest.approx(1 / RATE)


def test_a_test_narrows_the_intervals_of_a_fit_as_it_said():
    rng = np.random.default_rng(11)
    logs = one_frequency({}, rng)[:2]
    options = {"model": MODEL, "per": "all", "holdout": "none"}
    fit = mrfit.fit(logs, **options)
    advice = mrfit.advise(fit, logs, RIG)
    expected = advice.widths["after"]
    assert (expected < advice.widths["before"]).all()
    assert "geometric mean" in advice.text[0]
    again = mrfit.fit([*logs, *advised(advice, {}, rng, DRIVES[:1])], **options).params.loc[list(expected.index)]
    reached = (again["high"] - again["low"]) / 2
    # intervals allow for correlated noise, which differs from fit to fit
    assert np.exp(np.abs(np.log(reached / expected)).mean()) < 1.6
    assert (reached < 1.3 * advice.widths["before"]).all()


def test_a_fit_by_condition_shares_nothing_with_a_new_test():
    logs = one_frequency({}, np.random.default_rng(2))[:2]
    with pytest.raises(mrfit.ConfigError, match="--per all"):
        mrfit.advise(mrfit.fit(logs, model=MODEL), logs, RIG)


def test_the_same_seed_gives_the_same_advice():
    logs = one_frequency({}, np.random.default_rng(4))[:2]
    fit = mrfit.fit(logs, model=MODEL, per="all")
    first, second = (json.dumps(mrfit.advise(fit, logs, RIG).to_json()) for _ in range(2))
    assert first == second
