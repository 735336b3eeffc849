import numpy as np
import pytest

from mrfit.ingest.refusal import Refusal
from tests.ingest.conftest import ReadLog

FIRST = "MTS793|MPT|ESP|1|2|{mark}|/|:|51|1|1|A\r\n"
BLOCK = "\r\nAdquisición cíclica\t\t\tTiempo\t20,06\tSec\r\nPuntos: \t40\r\n"
BLOCK += "Tiempo\tFuerza\tCanal 1 Recuento\r\nSec\tkgf\tcycles\r\n"


def _rows(start: float, mark: str) -> str:
    return "".join(f"{start + k * 0.002:.3f}\t{k:.1f}\t99.5\r\n".replace(".", mark) for k in range(40))


@pytest.mark.parametrize("mark", [".", ","])
def test_blocks_are_runs_and_the_first_line_states_the_decimal_mark(mark: str, read_log: ReadLog) -> None:
    text = FIRST.format(mark=mark) + "".join(BLOCK + _rows(10.0 * k, mark) for k in (1, 2, 3))
    recordings = read_log(text.encode("latin-1"), "specimen.dat")
    assert [r.rows_kept for r in recordings] == [40, 40, 40]
    assert [r.start for r in recordings] == [10.0, 20.0, 30.0]
    assert {r.dt for r in recordings} == {0.002}
    np.testing.assert_allclose(recordings[2].channels["force"], 9.80665 * np.arange(40.0))
    assert recordings[0].units["canal_1_recuento"] == "1"


def test_masked_first_line(read_log: ReadLog) -> None:
    (record,) = read_log(("MTS***|MPT|**|*|*|*|*\r\n" + BLOCK + _rows(1.0, ",")).encode("latin-1"))
    assert record.rows_kept == 40


def test_operator_block_before_the_data(read_log: ReadLog) -> None:
    notes = "Operator Information\t\t\r\nanyone: 12, 13\t\t\r\nOperator Information End\t\t\r\n"
    (record,) = read_log((FIRST.format(mark=".") + notes + BLOCK + _rows(1.0, ".")).encode("latin-1"))
    assert (record.rows_kept, record.rows_refused) == (40, 0)


def test_header_without_units_is_refused(read_log: ReadLog) -> None:
    with pytest.raises(Refusal, match="no unit row"):
        read_log((FIRST.format(mark=".") + "a\tb\r\n" + _rows(1.0, ".")).encode("latin-1"))


def test_a_stray_blank_line_amid_a_run_costs_no_row(read_log: ReadLog) -> None:
    rows = _rows(10.0, ".").splitlines(keepends=True)
    text = FIRST.format(mark=".") + BLOCK + "".join([*rows[:20], "\r\n", *rows[20:]]) + BLOCK + _rows(20.0, ".")
    recordings = read_log(text.encode("latin-1"), "specimen.dat")
    assert [(r.rows_kept, r.rows_refused) for r in recordings] == [(40, 0), (40, 0)]
