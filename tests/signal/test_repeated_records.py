"""Repeats of one drive tell the noise of their outputs, in time that grows with their number, not with its square."""

import numpy as np
import pytest

from mrfit.core.recording import Recording, Segment
from mrfit.signal import repeated_records
from mrfit.signal.repeated_records import COMPARED_RECORDS, repeats_floor

NAN, DT, SAMPLES, NOISE = float("nan"), 1e-3, 400, 0.3


def floors(count: int) -> list[float]:
    """Return the floors of so many records of one random drive, each with noise of its own."""
    rng = np.random.default_rng(4)
    drive = np.cumsum(np.cumsum(rng.standard_normal(SAMPLES)))
    drive /= np.ptp(drive)
    segments, recordings, outputs = [], {}, []
    for k in range(count):
        output = 5.0 * drive + NOISE * rng.standard_normal(SAMPLES)
        recordings[f"r{k}"] = Recording(f"r{k}", "", "", "", DT, 0.0, {"displacement": drive, "force": output}, {})
        place = (0, SAMPLES, 0, "random", "displacement", 0.0, 1.0, 0.0, 0, NAN, NAN, "train")
        segments.append(Segment(f"r{k}#1", "random", f"r{k}", *place))
        outputs.append(output)
    return [floor.value for floor in repeats_floor(segments, recordings, outputs) if floor is not None]


def test_work_grows_with_the_number_of_repeats(monkeypatch: pytest.MonkeyPatch) -> None:
    compared = []
    difference = repeated_records._difference

    def counted(*given: object) -> object:
        compared.append(given[0].id)  # type: ignore[attr-defined]
        return difference(*given)  # type: ignore[arg-type]

    monkeypatch.setattr(repeated_records, "_difference", counted)
    found = floors(60)
    assert len(compared) == 60 * COMPARED_RECORDS
    assert found == pytest.approx([NOISE] * 60, rel=0.12)
    compared.clear()
    # few repeats are all compared with each other
    assert floors(COMPARED_RECORDS + 1) == pytest.approx([NOISE] * (COMPARED_RECORDS + 1), rel=0.12)
    assert len(compared) == (COMPARED_RECORDS + 1) * COMPARED_RECORDS
