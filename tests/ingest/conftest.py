"""Read a log from its text, as a user would from a file."""

from collections.abc import Callable
from pathlib import Path

import pytest

from mrfit.core.recording import Recording
from mrfit.ingest.stage import Settings
from tests.ingest.examining import examine

ReadLog = Callable[..., list[Recording]]


@pytest.fixture
def read_log(tmp_path: Path) -> ReadLog:
    """Return the recordings of a log given by name and content, with a channel map if one is given.

    A refused log raises its Refusal.
    """

    def read(content: str | bytes, name: str = "log.csv", channel_map: str = "") -> list[Recording]:
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        if channel_map:
            (tmp_path / "mrfit.toml").write_text(channel_map)
        recordings, refusals = examine([path], Settings())
        if refusals:
            raise refusals[0]
        return recordings

    return read
