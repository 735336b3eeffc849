"""Terms that a law may lack: closed forms of what they remember, and what is said of them."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.discover.invariance.nuisance import Scales
from mrfit.discover.policy import STANDARD
from mrfit.discover.repair.choice import Choice, TriedTerm
from mrfit.discover.repair.proposal import Repair, repaired
from mrfit.discover.repair.rows import FittedBase, RepairRows, shifted
from mrfit.discover.repair.terms import LEVELS, TERM_KINDS, LawTerm, TermInputs, candidates
from mrfit.discover.writing.law_repair import REPAIR_FILE, entry_of

SCALES = Scales(speed=0.5, travel=0.02, control=2.0, rate=40.0, order=2, span=800.0)
DT, COUNT = 1e-3, 400
STEADY = np.full(COUNT, 0.1)


def column(kind: str, v: Array, memory: float = 1.0, speed: float = 1.0, level: str = "", i: float = 1.0) -> Array:
    drive = TermInputs(v, np.full(len(v), i), 300.0 * np.ones(len(v)), DT)
    return LawTerm(kind, speed, memory, level).column(drive, SCALES)


def test_a_memory_of_the_travel_forgets_over_a_length() -> None:
    way = 0.1 * DT * np.arange(COUNT)
    np.testing.assert_allclose(column("travel", STEADY, memory=0.5), 1.0 - np.exp(-way / (0.5 * 0.02)), atol=1e-9)


def test_a_stop_follows_the_way_up_to_its_end_and_turns_at_once() -> None:
    v = np.where(np.arange(COUNT) < 300, 0.1, -0.1)
    z = column("stop", v, memory=0.5)
    length = 0.5 * 0.02
    np.testing.assert_allclose(z[:100], 0.1 * DT * np.arange(100) / length, atol=1e-9)
    assert z[250] == 1.0 and z[310] < 1.0
    np.testing.assert_allclose(np.diff(z[310:390]), -0.1 * DT / length, atol=1e-9)


def test_wear_grows_with_all_that_was_travelled() -> None:
    v = 0.1 * np.sign(np.sin(np.arange(COUNT) / 9.0 + 0.1))
    z = np.concatenate([[0.0], np.cumsum(np.abs(0.5 * (v[1:] + v[:-1])) * DT)]) / (100.0 * 0.02)
    np.testing.assert_allclose(column("degradation", v, memory=100.0, speed=0.05), z * np.tanh(v / 0.5 / 0.05))


def test_a_branch_lags_by_a_share_of_the_fastest_motion() -> None:
    step = np.where(np.arange(COUNT) > 0, 0.5, 0.0)
    tau = 0.4 / 40.0
    time = DT * np.arange(COUNT)
    np.testing.assert_allclose(column("maxwell", step, memory=0.4), 1.0 - np.exp(-time / tau), atol=0.06)
    assert column("maxwell", step, memory=0.4)[10] == pytest.approx(1.0 - np.exp(-1.0), abs=0.05)


@pytest.mark.parametrize(
    ("level", "i", "factor"),
    [("", 1.0, 1.0), ("*i", 1.0, 0.5), ("*i^2", 1.0, 0.25), ("*tanh(2*i/i_max)", 1.0, np.tanh(1.0)), ("*i", 0.0, 0.0)],
)
def test_a_term_is_scaled_by_a_function_of_the_current(level: str, i: float, factor: float) -> None:
    v = np.linspace(-0.5, 0.5, 9)
    np.testing.assert_allclose(column("viscous", v, level=level, i=i), factor * v / 0.5)
    np.testing.assert_allclose(column("square", v, level=level, i=i), factor * v * np.abs(v) / 0.25)


@pytest.mark.parametrize("kind", TERM_KINDS)
def test_every_term_reverses_with_the_motion(kind: str) -> None:
    own = TERM_KINDS[kind]
    rng = np.random.default_rng(1)
    v = np.convolve(rng.standard_normal(COUNT + 20), np.ones(21) / 21, "valid")
    force = 100.0 * np.tanh(20.0 * v)
    term = LawTerm(kind, own.speeds[0], own.memories[0])
    here, there = (term.column(TermInputs(side * v, np.ones(COUNT), side * force, DT), SCALES) for side in (1.0, -1.0))
    np.testing.assert_allclose(there, -here, atol=1e-12)
    assert np.ptp(here) > 0.0


@pytest.mark.parametrize(
    ("term", "said"),
    [
        (LawTerm("viscous", 1.0, 1.0), "v"),
        (LawTerm("friction", 0.02, 1.0, "*i"), "tanh(v/0.01)*i"),
        # a lag is a time, 0.4/w; a memory of the travel a length, 0.5 X
        (LawTerm("maxwell", 1.0, 0.4), "lag[0.01 s](v)"),
        (LawTerm("lagged-friction", 0.4, 0.15), "lag[0.00375 s](tanh(v/0.2))"),
        (LawTerm("stop", 1.0, 0.5), "stop[0.01 m]"),
        (LawTerm("travel-near", 0.3, 0.08), "z[0.0016 m]/cosh(v/0.15)^2"),
    ],
)
def test_a_term_is_said_in_si(term: LawTerm, said: str) -> None:
    assert term.text(SCALES) == said


def test_terms_are_tried_with_functions_of_the_current_only_where_it_varies() -> None:
    alone, varied = candidates(False), candidates(True)
    assert all(not t.level for t in alone) and len(varied) == len(LEVELS) * len(alone)
    assert len(set(varied)) == len(varied)
    # simple ones first: the first of those that are alike is taken
    assert [t.kind for t in dict.fromkeys(LawTerm(t.kind, 1.0, 1.0) for t in alone)] == list(TERM_KINDS)
    assert sum(t.kind == "lagged-friction" for t in alone) == 3 * 3


def rows(lengths: tuple[int, ...] = (80, 40), terms: tuple[LawTerm, ...] = ()) -> RepairRows:
    setting = SimpleNamespace(targets=[np.zeros(n) for n in lengths], scales=SCALES)
    columns = np.column_stack([np.arange(float(sum(lengths))), np.arange(float(sum(lengths))) ** 2])
    empty = np.zeros((sum(lengths), 1))
    at = np.repeat(np.arange(len(lengths)), lengths)
    return RepairRows(cast(Any, setting), terms, empty, columns, empty[:, 0], np.ones(3), at)


def test_terms_are_shifted_round_within_their_record_by_no_little_and_all_alike() -> None:
    own, rng = rows(), np.random.default_rng(0)
    for _ in range(50):
        found = shifted(own, rng)
        for first, last in ((0, 80), (80, 120)):
            part = found[first:last, 0]
            by = int(np.flatnonzero(part == first)[0])
            np.testing.assert_array_equal(part, np.roll(np.arange(first, last), by))
            np.testing.assert_array_equal(found[first:last, 1], part**2)
            share = by / (last - first)
            assert 0.12 < share < 0.88


def test_grams_are_those_of_the_rows_of_each_condition() -> None:
    own = rows()
    found = own.grams()
    whole = np.column_stack([own.base, own.columns, own.target])
    np.testing.assert_allclose(found[1], whole[80:].T @ whole[80:])
    np.testing.assert_allclose(own.grams(2.0 * own.columns)[0][1:3, 1:3], 4.0 * found[0][1:3, 1:3])


TERMS = (LawTerm("maxwell", 1.0, 0.4), LawTerm("viscous", 1.0, 1.0), LawTerm("maxwell", 1.0, 1.0))


def repair(why: str = "", errors: tuple[float, float] | None = (0.05, 0.02)) -> Repair:
    first = TriedTerm(0, np.ones(3), (1, 2), 0.6, 0.5)
    choice = Choice(np.ones(3), (first,), None)
    theta, spread = np.array([-0.2]), np.array([0.01])
    return Repair(TERMS[:1], why, rows(terms=TERMS), choice, theta, spread, 0.1, errors)


def test_a_strength_is_told_in_the_unit_of_the_output_with_scatter_and_accuracy() -> None:
    entry = entry_of(repair(), "force")
    (coefficient,) = entry.coefficients
    half = 800.0 * np.hypot(2.2 * 0.01, 0.04 * 0.2)
    assert (coefficient.name, coefficient.unit) == ("f1: lag[0.01 s](v)", "N")
    assert coefficient.value == pytest.approx(-160.0)
    assert (coefficient.low, coefficient.high) == (pytest.approx(-160.0 - half), pytest.approx(-160.0 + half))
    assert (entry.takes, entry.chance, entry.before, entry.after) == (0.6, 0.1, 0.05, 0.02)
    assert entry.file == REPAIR_FILE and "f1" in entry.source
    assert entry_of(repair(), "torque").coefficients[0].unit == "N*m"
    assert entry_of(repair(errors=None), "force").before is None


def test_of_terms_that_do_as_well_those_of_another_kind_are_told() -> None:
    assert entry_of(repair(), "force").alike == ("a viscous force",)
    assert entry_of(repair(), "force").titles == ("a Maxwell branch",)


def test_where_nothing_is_proposed_the_reason_and_what_chance_makes_are_told() -> None:
    entry = entry_of(repair("it does not lower the error on held-out conditions"), "force")
    assert (entry.reason, entry.chance) == ("it does not lower the error on held-out conditions", 0.1)
    assert entry.titles == () and entry.coefficients == ()


def test_too_few_records_are_no_reason_to_fail(monkeypatch: pytest.MonkeyPatch) -> None:
    two = rows((40, 40), TERMS[:1])
    monkeypatch.setattr("mrfit.discover.repair.proposal.rows_of", lambda *given: two)
    records = tuple(SimpleNamespace(control=np.ones(3)) for _ in range(2))
    found = repaired(FittedBase(cast(Any, records), (), (), ()), None, STANDARD)
    assert (found.terms, found.why) == ((), "there are too few records to leave some out")
