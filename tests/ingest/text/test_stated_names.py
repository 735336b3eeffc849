"""Names and units that lines of a header state one by one are those of the columns; other lines change nothing."""

import numpy as np
import pytest

from tests.ingest.conftest import ReadLog

K = np.arange(300)
STROKE, FORCE = np.round(10.0 * np.sin(0.05 * K), 3), np.round(0.8 * np.cos(0.05 * K), 4)
ROWS = "".join(f"{2e-3 * k:.3f},{x},{f}\n" for k, x, f in zip(K, STROKE, FORCE, strict=True))


@pytest.mark.parametrize(
    "header",
    [
        "# units: time s, displacement mm, force kN\ntime,displacement,force",
        "# displacement in mm; force in kN\ntime,displacement,force",
        "Force unit: kN\nDisplacement unit: mm\nTime,Displacement,Force",
        "All forces in kN, lengths in mm\nTime,Displacement,Force",
        "# col 1: time [s]\n# col 2: displacement [mm]\n# col 3: force [kN]",
        "% 1 Time (s)\n% 2 Stroke (mm)\n% 3 Force (kN)",
        "# Columns: 1 time [s]; 2 displacement [mm]; 3 force [kN]",
        "% 0: Time (s), 1: Stroke (mm), 2: Force (kN)",
        "# 1: Time (s)\n# 2: Stroke (mm, outwards positive)\n# 3: Force (kN)",
        "CH1 = Displacement [mm]\nCH2 = Force [kN]\nTime (s),CH1,CH2",
        "CH,Signal name,Range,Span\nCH1,Stroke,10V,mm\nCH2,Load,5V,kN\nTime (s),CH1,CH2",
    ],
)
def test_names_and_units_of_single_lines(header: str, read_log: ReadLog) -> None:
    (record,) = read_log(f"{header}\n{ROWS}")
    np.testing.assert_allclose(record.channels["displacement"], 1e-3 * STROKE)
    np.testing.assert_allclose(record.channels["force"], 1e3 * FORCE)


@pytest.mark.parametrize(
    "note",
    [
        "Force was in kN until May, in lbf since: force in kN, force in lbf",
        "Peak force 5 kN",
        "Forced oil cooling: on",
        "Driven by force in lbf steps",
    ],
)
def test_notes_that_state_no_unit_or_two_leave_the_si_unit_assumed(note: str, read_log: ReadLog) -> None:
    (record,) = read_log(f"# {note}\nTime,Displacement,Force\n{ROWS}")
    np.testing.assert_allclose(record.channels["force"], FORCE)
    assert "unit-assumed" in {f.kind for f in record.findings}


def test_a_written_unit_comes_before_a_note(read_log: ReadLog) -> None:
    (record,) = read_log(f"# force in kN\nTime (s),Displacement (mm),Force (N)\n{ROWS}")
    np.testing.assert_allclose(record.channels["force"], FORCE)
    (said,) = [f.text for f in record.findings if f.kind == "units-contradict"]
    assert said.endswith("states others: 'Force' in kN")
    (record,) = read_log(f"# Force unit: N\nTime (s),Displacement (mm),Force (N)\n{ROWS}")
    assert "units-contradict" not in {f.kind for f in record.findings}


def test_a_list_of_other_numbers_names_no_columns(read_log: ReadLog) -> None:
    with pytest.raises(Exception, match="no header says"):
        read_log(f"# Steps: 1 time [s]; 2 displacement [mm]\n{ROWS}")
    with pytest.raises(Exception, match="no header says"):
        read_log(f"# 4 Time (s)\n# 7 Stroke (mm)\n# 9 Force (kN)\n{ROWS}")
