"""What a preview tells a newcomer."""

from pathlib import Path

import pytest

from mrfit import summaries
from mrfit.ingest.stage import Settings, preview
from tests.ingest.samples import WRITERS


def test_preview_names_what_is_missing_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("one.txt", "two.txt"):
        (tmp_path / name).write_text("".join(f"{k * 0.01:.2f} {k % 7} {k % 5}\n" for k in range(50)))
    WRITERS["rigol"]().write(tmp_path)
    WRITERS["delimited"]().write(tmp_path)
    summaries.preview(preview([tmp_path], Settings()))
    printed = capsys.readouterr().out
    assert printed.count("refused ") == 3  # two files, and the column of that name
    assert printed.count("to read these 2: write a channel map, mrfit.toml beside it or --map: time = 0, then") == 1
    assert "NewFile1.csv: no channel a model takes" in printed
    assert "log.csv: no channel" not in printed


def test_preview_of_refused_files_alone_prints_no_empty_table(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "empty.csv").write_text("")
    summaries.preview(preview([tmp_path], Settings()))
    assert "What would be read" not in (printed := capsys.readouterr().out)
    assert "to read it: " in printed
