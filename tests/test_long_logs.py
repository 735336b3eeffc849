"""Memory that the stages take does not grow with the length of a log."""

import json
import shutil
from pathlib import Path

import pytest

from benchmarks.long_log import measured
from benchmarks.scale_long import STAGES, write

# Bytes of the larger log's channels in memory, several times what any stage may take more of it
MORE = 60.0


@pytest.mark.slow
def test_peak_memory_does_not_grow_with_the_log(tmp_path: Path) -> None:
    peaks: list[dict[str, float]] = []
    samples: list[int] = []
    for size in (0.12, 0.48):
        folder = tmp_path / str(size)
        write(folder / "long.csv", size)
        found = {}
        for name, options in STAGES.items():
            given = [str(folder / "long.csv")] if name == "ingest" else options
            found[name] = measured([name, *given, "--work", str(folder / "work")])[1]
        peaks.append(found)
        samples.append(json.loads((folder / "work" / "ingest.json").read_text())["recordings"][0]["rows_kept"])
        shutil.rmtree(folder)
    assert samples[0] > 1 << 22
    held = 8e-6 * 3 * (samples[1] - samples[0])
    assert held > 4 * MORE
    for name in STAGES:
        assert peaks[1][name] < 1000.0
        assert peaks[1][name] < peaks[0][name] + MORE, (name, peaks)
