"""Damaged logs end in a right read, a counted partial read, or one clear error.

Every mutation has a number; the same number damages the same sample in the same way, always. A reader that hangs
ends the run with its traceback.
"""

import faulthandler
import random
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from mrfit.core import registry
from mrfit.core.recording import Recording
from mrfit.errors import DataError
from mrfit.ingest.stage import Settings
from tests.ingest.examining import examine
from tests.ingest.samples import BINARY, RS_SETTINGS, WRITERS, Sample, matlab_seven_three

SAMPLES = {name: WRITERS[name]() for name in registry.names("reader")} | {"matlab-7.3": matlab_seven_three()}
NAMES = sorted(SAMPLES)
BYTES = {*BINARY, "matlab-7.3"}

LARGEST = 1 << 20
LONGEST = 60.0
"""Seconds one mutation may take, on a busy machine."""

Mutation = Callable[[bytes, random.Random], bytes]


def somewhere(length: int, rng: random.Random, head: int) -> int:
    """A place, every other time in the head, where most of what a reader must understand stands."""
    return rng.randrange(min(length, head) if rng.random() < 0.5 else length)


def byte_place(data: bytes, rng: random.Random) -> int:
    return somewhere(len(data), rng, 600)


def line_place(lines: Sequence[bytes], rng: random.Random) -> int:
    return somewhere(len(lines), rng, 20)


def flip_byte(data: bytes, rng: random.Random) -> bytes:
    place = byte_place(data, rng)
    return data[:place] + bytes([rng.randrange(256)]) + data[place + 1 :]


def flip_bit(data: bytes, rng: random.Random) -> bytes:
    place = byte_place(data, rng)
    return data[:place] + bytes([data[place] ^ (1 << rng.randrange(8))]) + data[place + 1 :]


def cut(data: bytes, rng: random.Random) -> bytes:
    return data[: rng.randrange(1, len(data) + 1)]


def lose_bytes(data: bytes, rng: random.Random) -> bytes:
    place = byte_place(data, rng)
    return data[:place] + data[place + rng.randrange(1, 40) :] or b"x"


def lose_line(data: bytes, rng: random.Random) -> bytes:
    lines = data.split(b"\n")
    del lines[line_place(lines, rng)]
    return b"\n".join(lines) or b"x"


def double_line(data: bytes, rng: random.Random) -> bytes:
    lines = data.split(b"\n")
    place = line_place(lines, rng)
    return b"\n".join([*lines[: place + 1], lines[place], *lines[place + 1 :]])


def swap_lines(data: bytes, rng: random.Random) -> bytes:
    lines = data.split(b"\n")
    one, two = line_place(lines, rng), line_place(lines, rng)
    lines[one], lines[two] = lines[two], lines[one]
    return b"\n".join(lines)


def cut_line(data: bytes, rng: random.Random) -> bytes:
    lines = data.split(b"\n")
    place = line_place(lines, rng)
    fields = lines[place].split(b",")
    lines[place] = b",".join(fields[: rng.randrange(len(fields) + 1)])
    return b"\n".join(lines) or b"x"


def other_delimiter(data: bytes, rng: random.Random) -> bytes:
    return data.replace(rng.choice([b",", b"\t"]), rng.choice([b";", b"\t", b"|", b" "]))


def other_decimal(data: bytes, rng: random.Random) -> bytes:
    return data.replace(b".", b",")


def nul_bytes(data: bytes, rng: random.Random) -> bytes:
    place = byte_place(data, rng)
    return data[:place] + b"\0" * rng.randrange(1, 9) + data[place:]


def other_line_ends(data: bytes, rng: random.Random) -> bytes:
    return data.replace(b"\r", b"").replace(b"\n", rng.choice([b"\r\n", b"\r", b"\r\r\n"]))


def utf16(data: bytes, rng: random.Random) -> bytes:
    return data.decode("latin-1").encode(rng.choice(["utf-16", "utf-16-le", "utf-16-be"]))


def overflow_marks(data: bytes, rng: random.Random) -> bytes:
    lines = data.split(b"\n")
    place = line_place(lines, rng)
    mark = b"\t" if b"\t" in lines[place] else b","
    fields = lines[place].split(mark)
    fields[rng.randrange(len(fields))] = rng.choice([b"1e38", b"NaN", b"inf", b"", "∞".encode(), b"-12.0mV", b"--"])
    lines[place] = mark.join(fields)
    return b"\n".join(lines)


def junk_in_front(data: bytes, rng: random.Random) -> bytes:
    return bytes(rng.randrange(256) for _ in range(rng.randrange(1, 30))) + data


ANY: list[Mutation] = [flip_byte, flip_bit, cut, lose_bytes, nul_bytes, junk_in_front]
TEXT: list[Mutation] = [
    *ANY,
    *(lose_line, double_line, swap_lines, cut_line, other_delimiter, other_decimal),
    *(other_line_ends, utf16, overflow_marks),
]
WHOLE_LINES: list[Mutation] = [lose_line, double_line, swap_lines, other_line_ends, utf16, overflow_marks]
"""Damage that leaves every number either whole or gone, so that what is read can be compared with the truth."""


def read_damaged(name: str, data: bytes) -> list[Recording]:
    """Read bytes under the name of a reader's sample, checking that all errors are single lines."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / SAMPLES[name].name
        path.write_bytes(data)
        if name == "rohde-schwarz":
            (Path(folder) / "RefCurve.csv").write_text(RS_SETTINGS)
        try:
            recordings, refusals = examine([path], Settings(jobs=1))
        except DataError as error:
            assert "\n" not in str(error)
            return []
    for refusal in refusals:
        assert "\n" not in str(refusal) and refusal.reason and refusal.remedy
    return recordings


def check_sound(records: list[Recording]) -> None:
    for record in records:
        assert np.isfinite(record.dt) and record.dt > 0.0
        assert record.rows_kept >= 2
        for values in record.channels.values():
            assert len(values) == record.samples
            assert np.isfinite(values).all()


def check_numbers(truth: Sample, records: list[Recording]) -> None:
    """The interval and every number of a channel known by name and unit are the truth's, unless a guess was said."""
    guessed = {f.channel for r in records for f in r.findings if f.kind == "unit-assumed"}
    for record in records:
        if "" not in guessed:
            assert record.dt == pytest.approx(truth.dt, rel=1e-6), [f.text for f in record.findings]
        if {f.kind for f in record.findings} & {"resampled", "dropped-samples"}:
            continue
        for channel, values in record.channels.items():
            if channel in guessed or record.units[channel] != truth.units.get(channel, None):
                continue
            known = np.sort(truth.channels[channel])
            place = np.clip(np.searchsorted(known, values), 1, len(known) - 1)
            off = np.minimum(np.abs(values - known[place - 1]), np.abs(values - known[place]))
            assert off.max() < 1e-9 * np.abs(known).max()


def damage(name: str, mutations: list[Mutation], number: int) -> bytes:
    """Return a reader's sample after one to four mutations."""
    rng = random.Random(f"{name} {len(mutations)} {number}")
    data = SAMPLES[name].data
    chosen = [rng.choice(mutations) for _ in range(rng.randint(1, 4))]
    if mutations is WHOLE_LINES:
        chosen.sort(key=lambda mutation: mutation is utf16)  # lines of UTF-16 cut at a byte are no whole ones
    for mutation in chosen:
        data = mutation(data, rng)[:LARGEST]
    return data


def assert_sound_when_damaged(name: str, mutations: list[Mutation], count: int) -> None:
    """Read ``count`` damaged samples; all that fail are named."""
    failed = []
    for number in range(count):
        faulthandler.dump_traceback_later(LONGEST, exit=True)
        try:
            records = read_damaged(name, damage(name, mutations, number))
            check_sound(records)
            if mutations is WHOLE_LINES:
                check_numbers(SAMPLES[name], records)
        except Exception as error:
            failed.append(f"{number}: {type(error).__name__} {str(error)[:200]}")
        finally:
            faulthandler.cancel_dump_traceback_later()
    assert not failed, f"{len(failed)} of {count} mutations of {name}: " + "; ".join(failed[:5])


def mutations_of(name: str) -> list[Mutation]:
    return ANY if name in BYTES else TEXT


@pytest.mark.parametrize("name", NAMES)
def test_any_damage_ends_in_a_read_or_one_line(name: str) -> None:
    assert_sound_when_damaged(name, mutations_of(name), 10)


@pytest.mark.parametrize("name", sorted(set(NAMES) - BYTES))
def test_no_wrong_number_after_damage_to_lines(name: str) -> None:
    assert_sound_when_damaged(name, WHOLE_LINES, 10)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_any_damage_two_thousand_times(name: str) -> None:
    assert_sound_when_damaged(name, mutations_of(name), 2000)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(set(NAMES) - BYTES))
def test_no_wrong_number_two_thousand_times(name: str) -> None:
    assert_sound_when_damaged(name, WHOLE_LINES, 2000)
