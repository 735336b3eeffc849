"""A column that counts the samples is the clock where a rate is stated."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrfit.core.recording import Recording
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Column
from mrfit.ingest.time.counter import counter_of
from tests.ingest.conftest import ReadLog

K = np.arange(400)
FORCE = 900.0 * np.sin(K / 20.0)


def log(counts: np.ndarray, rows: np.ndarray = K, name: str = "Sample") -> str:
    body = "".join(f"{c},{FORCE[k]:.4f}\n" for c, k in zip(counts, rows, strict=True))
    return f"Sample rate: 500 Hz\n{name},Load (N)\n{body}"


def assert_true(records: list[Recording], begin: int = 0) -> None:
    for record in records:
        first = round((record.start - records[0].start) / 0.002) + begin
        assert record.dt == 0.002
        np.testing.assert_allclose(record.channels["force"], FORCE[first : first + record.samples], atol=1.5)


@pytest.mark.parametrize("name", ["Sample", "Index", "Scan No.", "Point", "#", "Row number"])
@pytest.mark.parametrize("begin", [0, 1, 70000])
def test_left_out_samples_are_a_gap(name: str, begin: int, read_log: ReadLog) -> None:
    kept = np.delete(K, slice(100, 140))
    first, second = read_log(log(kept + begin, kept, name))
    assert (first.samples, second.samples) == (100, 260)
    assert second.start - first.start == pytest.approx(0.28)
    assert_true([first, second])
    assert {f.kind for f in first.findings} >= {"counted-samples", "gap"}


def test_few_left_out_samples_are_interpolated(read_log: ReadLog) -> None:
    kept = np.delete(K, [50, 51, 200])
    (record,) = read_log(log(kept, kept))
    assert record.samples == 400
    assert_true([record])


def test_a_count_that_repeats_or_starts_again(read_log: ReadLog) -> None:
    (record,) = read_log(log(np.insert(K, 100, 99), np.insert(K, 100, 99)))
    assert (record.samples, record.rows_refused) == (400, 1)
    assert_true([record])
    first, second = read_log(log(np.where(K < 250, K, K - 250)))
    assert (first.samples, second.samples) == (250, 150)
    np.testing.assert_allclose(second.channels["force"], FORCE[250:], atol=1e-3)


@pytest.mark.parametrize("bits", [8, 16])
def test_a_counter_that_overflows(bits: int, read_log: ReadLog) -> None:
    kept = np.delete(K, slice(300, 340))
    first, second = read_log(log((kept + 2**bits - 100) % 2**bits, kept))
    assert (first.samples, second.samples) == (300, 60)
    assert_true([first, second])


def test_counts_in_steps_ask_whose_rate_is_stated(read_log: ReadLog) -> None:
    with pytest.raises(Refusal, match="counted in steps of 10"):
        read_log(log(10 * K))
    kept = np.delete(K, slice(100, 140))
    assert_true(read_log(log(10 * kept, kept), channel_map="rate = 500\n"))


def test_counts_that_are_no_clock_are_refused_or_left(read_log: ReadLog) -> None:
    with pytest.raises(Refusal, match=r"'Sample' counts the samples, but not evenly \(line"):
        read_log(log(K // 2))
    (record,) = read_log(log(K // 100, name="Count"))  # cycles
    assert record.samples == 400
    (record,) = read_log(log(K))
    assert record.samples == 400 and "counted-samples" not in {f.kind for f in record.findings}


@given(st.lists(st.integers(1, 398), max_size=30, unique=True), st.integers(0, 10**6))
def test_counts_are_the_numbers_of_samples(lost: list[int], begin: int) -> None:
    kept = np.delete(K, lost)
    found = counter_of([Column("sample", None, (kept + begin).astype(float), 0)])
    if found is None:
        assert not lost
    else:
        np.testing.assert_array_equal(found[0], kept)
        assert found[1] == 1.0


@pytest.mark.parametrize("begin", [0, 1, 10000])
@pytest.mark.parametrize(
    ("header", "row"),
    [
        (",Disp (mm),Load (N)", "{n},{x},{f}"),
        ("Disp (mm),Load (N)", "{n},{x},{f}"),
        ("Unnamed: 0,Disp (mm),Load (N)", "{n},{x},{f}"),
        ("Disp (mm),,Load (N)", "{x},{n},{f}"),
        ("Disp (mm),Load (N),", "{x},{f},{n}"),
        (",Disp,Load\n,mm,N", "{n},{x},{f}"),
        ("Disp_mm Load_N", "{n} {x} {f}"),
        ('"Disp_mm" "Load_N"', '"{n}" {x} {f}'),
    ],
)
def test_a_column_without_a_name_that_counts(header: str, row: str, begin: int, read_log: ReadLog) -> None:
    kept = np.delete(K, slice(100, 140))
    body = "".join(row.format(n=k + begin, x=f"{k / 100:.4f}", f=f"{FORCE[k]:.4f}") + "\n" for k in kept)
    first, second = read_log(f"Sample rate: 500 Hz\n{header}\n{body}")
    assert (first.samples, second.samples) == (100, 260)
    assert second.start - first.start == pytest.approx(0.28)
    assert set(first.channels) == {"displacement", "force"}
    assert_true([first, second])


def test_columns_without_a_name_that_do_not_count(read_log: ReadLog) -> None:
    cycles = "".join(f"{k // 100},{f:.4f},{k % 7}\n" for k, f in zip(K, FORCE, strict=True))
    (record,) = read_log(f"Sample rate: 500 Hz\n,Load (N),\n{cycles}")
    assert record.samples == 400 and set(record.channels) == {"column0", "force", "column2"}
    mapped = '[channels]\nangle = {column = 0, unit = "deg"}\n'
    (record,) = read_log("Sample rate: 500 Hz\n,Load (N)\n" + log(K).split("\n", 2)[2], channel_map=mapped)
    assert set(record.channels) == {"angle", "force"}
