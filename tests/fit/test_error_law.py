"""Law of the error on unseen tests: planted laws, its coverage of further draws, and what widens it."""

import math
from dataclasses import replace

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.fit.error_law import ERRORS_ENOUGH, NORMAL, ErrorLaw
from mrfit.io.schemas.band import Remainder


def rows(errors: list[float] | Array, reaches: list[float] | Array | None = None, far: float = 0.0) -> list[Remainder]:
    ranges = [100.0] * len(errors) if reaches is None else reaches
    return [
        Remainder(condition=f"c{k}", role="left-out", quantile=float(q), reach=float(r), independent=1e3, beyond=far)
        for k, (q, r) in enumerate(zip(errors, ranges, strict=True))
    ]


def test_noise_does_not_grow_with_the_output_and_the_error_of_a_model_does() -> None:
    ranges = np.geomspace(1.0, 1e4, 30)
    noise, law = (ErrorLaw.of(rows(e, ranges)) for e in (np.full(30, 2.0), 0.05 * ranges))
    assert noise.half_width(1e4, 0.0) / noise.half_width(1e2, 0.0) == pytest.approx(1.0, abs=0.1)
    assert law.half_width(1e4, 0.0) / law.half_width(1e2, 0.0) == pytest.approx(100.0, rel=0.1)
    assert law.half_width(1e3, 0.0) == pytest.approx(50.0, rel=0.15)


@pytest.mark.parametrize("tests", [3, 7, 20, 60])
@pytest.mark.parametrize("scatter", [0.1, 0.35, 0.7])
def test_samples_of_further_tests_lie_within_as_often_as_stated(tests: int, scatter: float) -> None:
    rng, held = np.random.default_rng(tests), []
    for _ in range(200):
        ranges = np.exp(rng.normal(6.0, 0.7, tests + 1))
        sigmas = 0.05 * ranges * np.exp(scatter * rng.standard_normal(tests + 1))
        half = ErrorLaw.of(rows(NORMAL * sigmas[:-1], ranges[:-1])).half_width(float(ranges[-1]), 0.0)
        held.append(float(np.mean(np.abs(sigmas[-1] * rng.standard_normal(200)) <= half)))
    # with few tests little is known: more is promised of tests that are alike
    assert 0.93 <= np.mean(held) <= (0.998 if scatter < 0.35 else 0.985)


def test_fewer_tests_and_tests_that_differ_widen() -> None:
    few, many = (ErrorLaw.of(rows([2.0] * n)).half_width(100.0, 0.0) for n in (2, 30))
    assert few > 1.1 * many
    apart = ErrorLaw.of(rows([1.0, 2.0, 4.0] * 10)).half_width(100.0, 0.0)
    assert apart > 1.3 * many
    # one test alone has a width, too
    assert 2.0 < ErrorLaw.of(rows([2.0])).half_width(100.0, 0.0) < 8.0


def test_stretches_of_one_motion_count_as_one_test() -> None:
    (whole,) = rows([2.0])
    alone = ErrorLaw.of([whole]).half_width(100.0, 0.0)
    assert ErrorLaw.of([replace(whole, share=0.1)] * 10).half_width(100.0, 0.0) == pytest.approx(alone)
    assert ErrorLaw.of([whole] * 10).half_width(100.0, 0.0) < 0.8 * alone


def test_the_error_hardly_shrinks_with_the_output_unless_tests_say_so() -> None:
    """A model that falls short of a force simulates a short range: its error is none the less for it."""
    few, many = (ErrorLaw.of(rows([2.0] * n)) for n in (3, 30))
    assert few.half_width(10.0, 0.0) >= 0.65 * few.half_width(100.0, 0.0)
    shrunk = ErrorLaw.of(rows(0.02 * np.geomspace(10.0, 1000.0, 30), np.geomspace(10.0, 1000.0, 30)))
    assert shrunk.half_width(10.0, 0.0) < 0.2 * many.half_width(100.0, 0.0)


def test_a_test_beyond_the_others_has_a_wider_band() -> None:
    law = ErrorLaw.of(rows([2.0, 2.1, 1.9]))
    assert law.half_width(100.0, math.log(2.0)) > 1.3 * law.half_width(100.0, 0.0)
    # by what was seen of tests beyond
    grown = [*rows([2.0] * 6), *rows([8.0] * 6, far=math.log(2.0))]
    assert ErrorLaw.of(grown).half_width(100.0, math.log(2.0)) == pytest.approx(8.0, rel=0.5)
    assert ErrorLaw.of(grown).half_width(100.0, 0.0) < 4.0


def test_with_many_tests_their_ranks_bound_the_width() -> None:
    """Two kinds of tests, of which no law with one scatter knows: a tenth err ten times as much."""
    errors = np.where(np.arange(ERRORS_ENOUGH) % 10 == 0, 20.0, 2.0)
    half = ErrorLaw.of(rows(errors)).half_width(100.0, 0.0)
    shares = [math.erf(NORMAL * half / e / math.sqrt(2.0)) for e in errors]
    assert sum(shares) / (ERRORS_ENOUGH + 1) >= 0.9499
