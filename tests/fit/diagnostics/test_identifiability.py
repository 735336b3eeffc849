"""The verdict on what data determine, on cases whose answer is known."""

import re

import numpy as np
import pytest

from mrfit.core import registry
from mrfit.core.specs import Array, Param
from mrfit.fit.diagnostics.identifiability import Verdict, _advice, judge, sparse_directions
from mrfit.fit.diagnostics.uncertainty import Uncertainty, analyse
from tests.fit.toy import linear_model, segment

SAMPLES = 2000
PHASE = np.linspace(0, 8 * np.pi, SAMPLES, endpoint=False)
SINE, COSINE, ONE = np.sin(PHASE), np.cos(2 * PHASE), np.ones(SAMPLES)


def verdict(columns: list[Array], noise: float = 0.01, point: Array | None = None, role: str = "yield") -> Verdict:
    """Judge sensitivities to parameters of -1 … 1, given per cube."""
    rng = np.random.default_rng(1)
    _, cube = linear_model(*[role] * len(columns))
    found = analyse([np.column_stack(columns)], [noise * rng.standard_normal(SAMPLES)], [SAMPLES / 4])
    at = np.full(len(columns), 0.5) if point is None else point
    return judge(cube, at, found, [segment(SAMPLES, 4)], error=noise)


@pytest.mark.parametrize(
    ("columns", "open_names", "to_fix", "words"),
    [
        ([SINE, COSINE, ONE], (), 0, "all 3 parameters"),
        ([SINE, 1e-2 * COSINE, ONE], (), 0, "all 3 parameters"),
        ([SINE, 2 * SINE, ONE], ("p0", "p1"), 1, "together leave the output as it is"),
        ([SINE, COSINE, SINE + COSINE], ("p0", "p1", "p2"), 1, "only 2 combinations"),
        ([SINE, 0 * ONE, ONE], ("p1",), 1, "p1 has no effect on the output"),
        (
            [SINE, 3e-4 * COSINE, ONE],
            ("p1",),
            1,
            "p1 +0.04 changes the output by 0.042 % of the error",
        ),
        ([SINE, SINE + 3e-4 * COSINE], ("p0", "p1"), 1, "together change the output by"),
    ],
    ids=["full", "scaled", "redundant", "redundant sum", "without effect", "drowned", "drowned difference"],
)
def test_known_cases_get_the_right_verdict(
    columns: list[Array], open_names: tuple[str, ...], to_fix: int, words: str
) -> None:
    found = verdict(columns)
    assert found.open == open_names
    assert len(found.fix) == to_fix
    assert set(found.fix) <= set(open_names)
    assert words in " ".join(found.sentences)


def test_the_direction_of_trade_is_that_of_the_redundancy() -> None:
    text = " ".join(verdict([SINE, 2 * SINE, ONE]).sentences)
    # p0 up by twice what p1 goes down leaves p0*u + p1*2u as it is
    assert "p0 +0.04 and p1 −0.02 together" in text


def test_fixing_what_is_advised_determines_the_rest() -> None:
    columns = [SINE, COSINE, SINE + COSINE, ONE]
    found = verdict(columns)
    kept = [c for k, c in enumerate(columns) if f"p{k}" not in found.fix]
    assert verdict(kept).open == ()


def test_a_parameter_at_a_bound_is_named() -> None:
    found = verdict([SINE, ONE], point=np.array([1.0, 0.5]))
    assert found.open == ()
    assert any("p0 ended at a bound" in s for s in found.sentences)


def test_advice_names_small_loops_for_a_hysteresis_and_nothing_for_a_redundancy() -> None:
    drowned = " ".join(verdict([SINE, 3e-4 * COSINE], role="hysteresis").sentences)
    assert "small amplitude (0.02 to 0.2 A)" in drowned
    redundant = " ".join(verdict([SINE, 2 * SINE], role="hysteresis").sentences)
    assert "add " not in redundant


def test_sparse_directions_span_the_space_they_came_from() -> None:
    rng = np.random.default_rng(3)
    null = np.linalg.qr(rng.standard_normal((6, 2)))[0]
    reduced = np.column_stack(sparse_directions(null))
    assert np.allclose(null @ (null.T @ reduced), reduced)
    assert np.linalg.matrix_rank(reduced) == 2
    assert all(np.sum(np.abs(d) < 1e-9) >= 1 for d in reduced.T)


def test_an_interval_wider_than_the_bounds_is_said_where_no_direction_is() -> None:
    _, cube = linear_model(*["yield"] * 2)
    half = np.array([[1.0, 1.0], [1.0, -1.0]]) / np.sqrt(2.0)
    spreads = np.array([0.24, 0.24])
    found = Uncertainty(
        covariance=half @ np.diag(2 * spreads**2) @ half.T,
        directions=half,
        open=np.zeros(2, dtype=bool),
        spreads=spreads,
        singular_values=np.ones(2),
        degrees=1000.0,
    )
    said = judge(cube, np.full(2, 0.5), found, [segment(SAMPLES, 4)], error=0.01)
    assert said.open == ("p0", "p1")
    assert "all 2 parameters" not in " ".join(said.sentences)
    assert "p0 and p1 alone would be wider than the bounds" in said.sentences[0]


@pytest.mark.parametrize("fast", [0.3, 3.0])
def test_a_stated_change_of_the_output_is_what_a_simulation_gives(fast: float) -> None:
    # the model lacks a term, so that its errors are alike from cycle to cycle
    rng = np.random.default_rng(2)
    left = 0.1 * np.cos(fast * PHASE / 4.0) + 0.01 * rng.standard_normal(SAMPLES)
    _, cube = linear_model("yield", "yield")
    columns = np.column_stack([SINE, SINE + 0.003 * COSINE])
    found = analyse([columns], [left], [0.0])
    error = float(np.sqrt(np.mean(left**2)))
    text = " ".join(judge(cube, np.full(2, 0.5), found, [segment(SAMPLES, 4)], error=error).sentences)
    said = re.search(
        r"p(\d) \+([\d.]+) and p(\d) −([\d.]+) together change the output by ([\d.]+) % of the error", text
    )
    assert said, text
    moved = np.zeros(2)
    moved[int(said[1])], moved[int(said[3])] = float(said[2]) / 2.0, -float(said[4]) / 2.0
    change = float(np.sqrt(np.mean((columns @ moved) ** 2)))
    assert change / error == pytest.approx(float(said[5]) / 100.0, rel=0.06)


@pytest.mark.parametrize(("place", "side"), [(0.0, "its lower bound, -1 N: the data ask for no more"), (1.0, "less")])
def test_a_parameter_at_its_bound_is_not_said_to_have_no_effect(place: float, side: str) -> None:
    said = " ".join(verdict([SINE, 0 * ONE, ONE], point=np.array([0.5, place, 0.5])).sentences)
    assert "no effect" not in said
    assert "hold p1 (" not in said
    assert "nothing of p1" not in said
    assert side in said
    inside = " ".join(verdict([SINE, 0 * ONE, ONE]).sentences)
    assert "p1 has no effect on the output in this test" in inside
    assert "hold p1 (" in inside


def test_advice_for_a_parameter_without_a_role_is_what_its_effect_states() -> None:
    segments = [segment(SAMPLES, 4)]
    own = Param("delay.tau", "s", 0.0, 0.1, 0.0)
    assert _advice(own, segments) == registry.load("effect", "delay").SPEC.experiment
    assert _advice(Param("v0", "m/s", 1e-4, 1.0, 0.01), segments) == ""
    assert "loop's knee" in _advice(Param("n", "1", 1.0, 2.0, 1.0, role="hysteresis"), segments)
