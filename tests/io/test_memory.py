"""Memory that is needed is told before work begins, and refused where there is not so much."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from mrfit.errors import DataError, MissingResource
from mrfit.io import memory


@pytest.fixture(autouse=True)
def nobody_listens() -> Iterator[None]:
    yield
    memory.on_need(None)


@pytest.fixture
def free(monkeypatch: pytest.MonkeyPatch) -> float:
    monkeypatch.setattr(memory, "free_memory", lambda: 30e9)
    return 30e9


def test_what_fits_is_told_where_it_is_much_and_once(free: float) -> None:
    told: list[str] = []
    memory.on_need(told.append)
    memory.check_room("few samples", 0.9e9 / memory.SAMPLE_COPIES)
    assert told == []
    memory.check_room("many samples", 6e9 / memory.SAMPLE_COPIES)
    assert told == ["many samples are held in memory: about 6.0 GB, 30.0 GB are free"]
    memory.check_room("part of these", 5e9 / memory.SAMPLE_COPIES)
    assert len(told) == 1
    memory.check_room("still more samples", 7e9 / memory.SAMPLE_COPIES)
    assert len(told) == 2


def test_a_new_command_is_told_anew(free: float) -> None:
    told: list[str] = []
    for _ in range(2):
        memory.on_need(told.append)
        memory.check_room("many samples", 6e9 / memory.SAMPLE_COPIES)
    assert len(told) == 2


def test_what_does_not_fit_is_refused_with_the_thinning_that_would(free: float) -> None:
    memory.check_room("these samples", free / memory.SAMPLE_COPIES)
    with pytest.raises(MissingResource, match=r"need about 75\.0 GB of memory and 30\.0 GB are free; .* = 3 or more"):
        memory.check_room("these samples", 2.5 * free / memory.SAMPLE_COPIES)
    assert issubclass(MissingResource, DataError)


def test_where_the_system_does_not_say_all_memory_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    known = memory.free_memory()
    assert 0.0 < known < 1e15

    def no_file(*_: object, **__: object) -> str:
        raise OSError

    monkeypatch.setattr(Path, "read_text", no_file)
    whole = memory.free_memory()
    assert whole >= known
    monkeypatch.setattr(memory.os, "sysconf", lambda name: (_ for _ in ()).throw(ValueError(name)))
    assert memory.free_memory() == float("inf")
