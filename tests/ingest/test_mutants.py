"""Damaged logs are read as their bytes say, or their rows are counted as refused: no value changes in silence."""

import random
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mrfit.ingest.stage import Settings
from tests.ingest.examining import examine
from tests.ingest.mutants import MUTATIONS, SUBJECTS, TEXT_WRITERS, campaign, judge, read, text_mutant

QUICK = 4
WHOLE_CAMPAIGN = 50_000
MEMORY = 1024
"""MB that reading mutants may take at most."""


@pytest.mark.parametrize("reader", sorted(TEXT_WRITERS))
@settings(max_examples=8, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(mutations=st.lists(st.sampled_from(MUTATIONS), max_size=3), seed=st.integers(0, 2**32))
def test_no_mutation_changes_a_value_in_silence(reader: str, mutations: list, seed: int) -> None:
    mutant = text_mutant(reader, random.Random(seed), mutations)
    recordings, refusals = read(mutant)
    assert not judge(mutant, recordings, refusals)
    assert mutations or recordings  # a sound log is read


@pytest.mark.parametrize("name", sorted(set(SUBJECTS) - set(TEXT_WRITERS)))
def test_first_mutants_of_other_formats(name: str) -> None:
    assert not campaign(name, 0, QUICK).faults


def _spoilt(tmp_path: Path, spoil: str) -> list[str]:
    """Return what the oracle says of a sound reading that is spoilt afterwards."""
    mutant = text_mutant("delimited", random.Random(0), [])
    (tmp_path / mutant.file).write_bytes(mutant.data)
    (record,), _ = examine([tmp_path / mutant.file], Settings(jobs=1))
    current = record.channels["current"].copy()
    if spoil == "one value":
        current[100] += 1e-4
    elif spoil == "shifted":
        current = np.roll(current, 1)
    elif spoil == "sign":
        current = -current
    elif spoil == "huge":
        current[7] = 1e12
    changes = {"stretched": {"dt": record.dt * 1.016}, "one row less": {"rows_kept": record.rows_kept - 1}}
    channels = {**record.channels, "current": current}
    if spoil == "exchanged":
        channels = {"current": record.channels["flux"], "flux": record.channels["current"]}
    return judge(mutant, [replace(record, channels=channels, **changes.get(spoil, {}))], [])


@pytest.mark.parametrize(
    "spoil", ["one value", "shifted", "sign", "huge", "stretched", "one row less", "exchanged", "nothing"]
)
def test_the_oracle_sees_what_is_wrong(spoil: str, tmp_path: Path) -> None:
    assert bool(_spoilt(tmp_path, spoil)) == (spoil != "nothing")


@pytest.mark.slow
def test_fifty_thousand_mutants(capsys: pytest.CaptureFixture[str]) -> None:
    """No traceback, no hang, no gigabyte, no silent change, over all formats; prints what became of them."""
    each = -(-WHOLE_CAMPAIGN // len(SUBJECTS))
    tallies = {name: campaign(name, 0, each) for name in sorted(SUBJECTS)}
    with capsys.disabled():
        print()
        for name, tally in tallies.items():
            print(tally.line(name))
        print(
            f"{sum(t.number for t in tallies.values())} mutants, {sum(len(t.faults) for t in tallies.values())} faults"
        )
    assert not [fault for tally in tallies.values() for fault in tally.faults][:20]
    assert max(tally.peak for tally in tallies.values()) < MEMORY


# The second header has a time in another unit; an unknown unit stands in the first; the first row is damaged; a garbled
# cell looks like a factor; overload marks stand around the header; rows stand above the only header that can be read;
# a damaged row stands right above the second; a comment does; marks of overload part two rows of units;
# units are given twice; a short first row hides that the last number is cut.
@pytest.mark.parametrize(
    ("name", "number"),
    [
        ("delimited", 300127),
        ("picoscope", 300678),
        ("mts-testsuite", 300323),
        ("delimited-blanks-two-headers", 119),
        ("delimited-semicolon-two-headers", 170),
        ("leybold-cassy-two-headers", 123),
        ("leybold-cassy-two-headers", 810007),
        ("leybold-cassy-two-headers", 960268),
        ("leybold-cassy", 1200237),
        ("picoscope-two-headers", 1311146),
        ("rigol", 1311190),
        ("siglent-two-headers", 960378),
    ],
)
def test_a_header_within_a_log_is_seen_whatever_else_is_damaged(name: str, number: int) -> None:
    tally = campaign(name, number, 1)
    assert not tally.faults and tally.outcomes["read"] == 1


def test_the_oracle_lets_a_comment_be_of_a_header_and_no_row() -> None:
    name, number = "leybold-cassy-two-headers", 960268
    mutant = SUBJECTS[name](random.Random(f"{name} {number}"))
    (first, second), refusals = read(mutant)
    assert mutant.notes == 1 and not judge(mutant, [first, second], refusals)
    assert judge(mutant, [replace(first, rows_kept=first.rows_kept - 1), second], refusals)
