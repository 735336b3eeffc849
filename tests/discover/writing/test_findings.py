"""Numbers of what is said of a decision: gaps, drifts, advice, columns of the page."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.discover.evidence.bench import Bench
from mrfit.discover.evidence.refit import Refit
from mrfit.discover.policy import STANDARD
from mrfit.discover.selection.exact_base import Follower, Selection
from mrfit.discover.selection.questions import EffectScreening, Growth
from mrfit.discover.writing import findings
from mrfit.discover.writing.findings import drifts_of, gap_of, series_of
from mrfit.errors import DataError
from tests.discover.world import fit

DT = 0.01


def stretch(name: str, role: str, count: int, floor: float = 1.0, known: bool = True, **more: Any) -> SimpleNamespace:
    segment = SimpleNamespace(id=f"{name}#0", condition=name, role=role, samples=count, cycles=0)
    own = {"measured": np.linspace(0.0, 1.0, count), "recorded": 0.0, "level_rate": 0.0} | more
    noise = SimpleNamespace(known=known)
    return SimpleNamespace(segment=segment, floor=floor, noise=noise, block=SimpleNamespace(dt=DT), **own)


def bench(*stretches: SimpleNamespace, span: float = 100.0) -> Bench:
    def of_role(role: str) -> list[SimpleNamespace]:
        return [s for s in stretches if s.segment.role == role]

    return cast(Bench, SimpleNamespace(stretches=stretches, of_role=of_role, span=span))


def errors(holdout: Sequence[Array] = (), train: Sequence[Array] = ()) -> Refit:
    return cast(Refit, SimpleNamespace(train=list(train), holdout=list(holdout)))


TWO = (stretch("a", "holdout", 10, floor=1.0), stretch("b", "holdout", 30, floor=2.0))


def held(error: float) -> Refit:
    """Return a fit that leaves so many noise floors in every held-out sample."""
    return errors([np.full(10, error), np.full(30, -error)])


def test_a_gap_is_that_of_all_held_out_samples_over_the_range() -> None:
    found = gap_of(bench(*TWO), held(5.0), held(2.0))
    floor = np.sqrt((10 * 1.0 + 30 * 4.0) / 40)
    assert found.noise_floor == pytest.approx(floor / 100.0)
    assert (found.before, found.after) == (pytest.approx(5.0 * floor / 100.0), pytest.approx(2.0 * floor / 100.0))
    # of 25 - 1 parts 25 - 4 are taken
    assert found.closed == pytest.approx(21.0 / 24.0)


def test_no_more_than_all_of_a_gap_is_closed_and_none_where_there_is_none() -> None:
    assert gap_of(bench(*TWO), held(5.0), held(0.9)).closed == 1.0
    assert gap_of(bench(*TWO), held(5.0), held(6.0)).closed == pytest.approx(-11.0 / 24.0)
    assert gap_of(bench(*TWO), held(0.99), held(0.9)).closed is None


def test_of_a_floor_that_is_not_known_no_share_is_told() -> None:
    unknown = bench(TWO[0], stretch("b", "holdout", 30, floor=2.0, known=False))
    found = gap_of(unknown, held(5.0), held(2.0))
    assert (found.noise_floor, found.closed) == (None, None)
    assert found.before == gap_of(bench(*TWO), held(5.0), held(2.0)).before


def test_a_simulation_that_diverged_is_one_line() -> None:
    with pytest.raises(DataError, match="held-out conditions diverged; choose another base model"):
        gap_of(bench(*TWO), held(5.0), held(np.inf))


def drifting(rate: float, gain: float, level_rate: float = 0.0) -> tuple[Bench, Refit]:
    """Return a record of 20 s whose level and gain drift, with a fit that knows of neither."""
    rng, count = np.random.default_rng(2), 2000
    time = np.arange(count) * DT
    output = 50.0 * np.sin(2.0 * np.pi * 3.1 * time)
    noise = 0.1 * rng.standard_normal(count)
    measured = output * (1.0 + gain * time) + rate * time + noise
    own = stretch("a", "train", count, floor=0.1, measured=measured, level_rate=level_rate)
    return bench(own), errors(train=[(output - measured) / 0.1])


@pytest.mark.parametrize(("rate", "gain"), [(0.05, 0.0), (-0.05, 0.0), (0.0, 0.01), (0.0, -0.01)])
def test_a_drift_that_a_fit_leaves_is_told_with_its_sign(rate: float, gain: float) -> None:
    (row,) = drifts_of(*drifting(rate, gain))
    assert (row.condition, row.segment, row.follows) == ("a", "a#0", "")
    assert row.level_rate == pytest.approx(rate, rel=0.1, abs=1e-12)
    assert row.gain_rate == pytest.approx(gain, rel=0.1, abs=1e-12)


def test_a_record_without_a_drift_has_no_row_and_one_that_was_straightened_has_its_rate() -> None:
    assert drifts_of(*drifting(0.0, 0.0)) == []
    (row,) = drifts_of(*drifting(0.0, 0.0, level_rate=0.7))
    assert (row.level_rate, row.gain_rate) == (0.7, 0.0)


def test_an_effect_that_followed_a_drift_is_told_of_every_fitted_record() -> None:
    base = fit(1.0)
    growth = Growth(0.1, 0.2, 0.01, rates=(3.0, -4.0))
    chosen = Selection(base, base, base, EffectScreening(base), drifting=(Follower("delay", growth),))
    own = bench(stretch("a", "train", 5), stretch("h", "holdout", 5), stretch("b", "train", 5))
    rows = findings._followed(own, chosen)
    assert [(r.condition, r.follows, r.rate) for r in rows] == [("a", "delay", 3.0), ("b", "delay", -4.0)]


@pytest.mark.parametrize(
    ("verdict", "said"), [("insufficient-data", True), ("unexplained", False), ("none", False), ("named", False)]
)
def test_tests_of_unknown_noise_are_asked_for_twice_only_where_the_noise_decides(verdict: str, said: bool) -> None:
    unknown = [stretch(n, "holdout", 5, known=False) for n in ("z", "b", "b")]
    own = bench(*unknown, stretch("c", "holdout", 5), stretch("d", "train", 5, known=False))
    advice = findings._unknown_noise(own, verdict)
    assert len(advice) == said
    assert not said or advice[0].startswith("the noise floor of b, z is not known")


def test_the_page_has_every_sample_with_its_time_and_errors_in_the_unit_of_the_output() -> None:
    own = bench(stretch("h", "holdout", 2, floor=3.0, recorded=7.0), stretch("t", "train", 3, floor=2.0, recorded=0.5))
    before, after = errors([np.ones(2)], [np.arange(3.0)]), errors([np.zeros(2)], [np.full(3, -1.0)])
    found = series_of(own, before, after)
    assert found["segment"].tolist() == [1.0, 1.0, 1.0, 0.0, 0.0]
    assert found["holdout"].tolist() == [0.0, 0.0, 0.0, 1.0, 1.0]
    np.testing.assert_allclose(found["time"], [0.5, 0.51, 0.52, 7.0, 7.01])
    assert found["before"].tolist() == [0.0, 2.0, 4.0, 3.0, 3.0]
    assert found["after"].tolist() == [-2.0, -2.0, -2.0, 0.0, 0.0]
    assert found["measured"].tolist() == [0.0, 0.5, 1.0, 0.0, 1.0]


@pytest.mark.parametrize(("left", "told"), [(None, True), (0.101, True), (0.099, False)])
def test_of_the_rest_is_told_where_it_is_worth_it_or_nobody_knows(left: float | None, told: bool) -> None:
    own = SimpleNamespace(share_left=left)
    assert findings.Findings.tells_of_the_rest(cast(findings.Findings, own), STANDARD) is told
