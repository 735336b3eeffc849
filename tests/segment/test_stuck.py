"""Samples at which a channel is stuck are compared with nothing; all others are, where they are enough."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrfit.core.recording import LEAD_IN, Finding, Recording, Segment
from mrfit.core.specs import Array
from mrfit.ingest.meaning.faults import fault_findings
from mrfit.segment.detect import Detection, detect
from mrfit.segment.stuck import FEWEST_SAMPLES, StuckRows, around, stuck_stretches
from tests.flux.records import recording

DT = 2e-3
PLACE = Segment("a#1", "", "a", 300, 3000, 300, "random", "displacement", 0.0, 1.0, 0.0, 0, 0.0, 20.0, "train")
WAVE = replace(PLACE, waveform="sine", frequency=1.0 / (500.0 * DT), cycles=5, start=500, warm_up=500)


def _log(road: bool, *held: tuple[str, int, int]) -> Recording:
    rng = np.random.default_rng(3)
    time = DT * np.arange(3000)
    tones = rng.uniform(0.5, 8.0, (12, 1)) if road else np.array([[2.0]])
    turns = rng.uniform(0.0, 6.0, (len(tones), 1)) if road else 0.0
    x = np.sum(np.sin(2.0 * np.pi * tones * time + turns) / tones, axis=0)
    channels = {"displacement": x + 1e-3 * rng.standard_normal(len(time))}
    channels["force"] = 500.0 * np.gradient(x) / DT / 30.0 + 20.0 * rng.standard_normal(len(time))
    for name, begin, stop in held:
        channels[name][begin:stop] = channels[name][begin]
    whole = recording("log", DT, channels)
    return replace(whole, findings=tuple(fault_findings(whole)))


def _cut(log: Recording) -> Detection:
    return detect(log, "displacement", 2, 1, 0.1)


def _compared(found: Detection) -> Array:
    marked = np.zeros(found.samples, dtype=int)
    for s in found.segments:
        marked[s.start : s.stop] += 1
    return marked


@pytest.mark.parametrize("road", [True, False])
@pytest.mark.parametrize("held", [12, 40])
def test_a_stuck_output_is_not_compared_and_the_model_goes_on_through_it(road: bool, held: int) -> None:
    log = _log(road, ("force", 1400, 1400 + held), ("force", 2200, 2200 + held))
    found, sound = _cut(log), _cut(_log(road))
    marked, whole = _compared(found), _compared(sound)
    assert sound.kept - found.kept == whole.sum() - marked.sum()
    assert not marked[1400 : 1400 + held].any() and not marked[2200 : 2200 + held].any()
    # of two cycles and more only whole ones are compared
    least = 0.97 if road else 0.6
    assert marked.max() == 1 and marked.sum() >= least * whole.sum()
    first = sound.segments[0]
    assert {s.start - s.warm_up for s in found.segments} == {first.start - first.warm_up}
    assert [s.id for s in found.segments] == [f"log#{k}" for k in range(1, len(found.segments) + 1)]
    (text,) = [f for f in found.findings if "stuck" in f]
    assert text == f"log: {whole.sum() - marked.sum()} samples where force is stuck, and about them, not compared"


def test_behind_a_stuck_input_the_model_settles_once_more() -> None:
    found = _cut(_log(True, ("displacement", 1400, 1500)))
    before, behind = found.segments
    assert before.stop == 1400
    assert behind.start - behind.warm_up == 1500
    assert behind.warm_up == pytest.approx(LEAD_IN * (3000 - 1500), abs=1.0)


def test_a_sound_log_is_cut_as_it_was() -> None:
    log = _log(True)
    assert log.findings == ()
    assert not any("stuck" in f for f in _cut(log).findings)


def test_a_channel_that_stands_still_for_long_is_no_fault_to_be_cut() -> None:
    log = _log(True, ("force", 400, 1400))
    assert stuck_stretches(log) == []
    told = replace(log, findings=(Finding("stuck", "force", 0.8, ""),))
    assert stuck_stretches(told) == [] and len(_cut(told).segments) == 1


def test_a_segment_stays_whole_where_no_piece_is_long_enough() -> None:
    every = [StuckRows(slice(k, k + 20), "force") for k in range(300, 3000, FEWEST_SAMPLES)]
    assert around([PLACE], every, DT) == [PLACE]


def test_what_is_shorter_than_two_cycles_is_compared_without_cycles() -> None:
    first, second, last = around([WAVE], [StuckRows(slice(k, k + 20), "force") for k in (900, 2400)], DT)
    assert [(p.start, p.stop, p.cycles) for p in (first, second, last)] == [
        (500, 900, 0),
        (1400, 2400, 2),
        (2420, 3000, 0),
    ]


@given(faults=st.lists(st.tuples(st.integers(0, 2990), st.integers(8, 60)), max_size=5))
def test_pieces_hold_no_stuck_sample_and_whole_cycles(faults: list[tuple[int, int]]) -> None:
    stuck = [StuckRows(slice(a, min(a + n, 3000)), "force") for a, n in sorted(faults)]
    for segment in (PLACE, WAVE):
        pieces = around([segment], stuck, DT)
        if pieces == [segment]:
            continue
        ends = [(p.start, p.stop) for p in pieces]
        assert ends == sorted(ends) and all(a < b for a, b in ends)
        assert all(b <= c for (_, b), (c, _) in zip(ends, ends[1:], strict=False))
        assert all(p.stop <= s.rows.start or p.start >= s.rows.stop for p in pieces for s in stuck)
        assert all(abs(p.samples - p.cycles * 500) <= 1 and p.cycles > 1 for p in pieces if p.cycles)
