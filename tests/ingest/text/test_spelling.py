"""Numbers spelt in other ways give what plain ones give; plain ones are left as they are."""

import numpy as np
import pytest

from tests.ingest.conftest import ReadLog

K = np.arange(1500)
TIME = 2.0 * K
MOTION = 10.0 * np.sin(0.025 * K)
FORCE = 9876.0 * np.cos(0.025 * K)


def _grouped(value: float, digits: int, mark: str, decimal: str) -> str:
    return f"{value:,.{digits}f}".replace(",", "\0").replace(".", decimal).replace("\0", mark)


def _log(delimiter: str, mark: str, decimal: str, digits: tuple[int, int, int], quote: str = "") -> str:
    head = delimiter.join(["Time (ms)", "Disp (mm)", "Force (N)"])
    columns = zip(TIME, MOTION, FORCE, strict=True)
    rows = (
        delimiter.join(f"{quote}{_grouped(v, d, mark, decimal)}{quote}" for v, d in zip(r, digits, strict=True))
        for r in columns
    )
    return "\n".join([head, *rows, ""])


@pytest.mark.parametrize("digits", [(0, 4, 0), (3, 4, 3), (3, 4, 0), (0, 2, 1)])
@pytest.mark.parametrize(
    ("delimiter", "mark", "decimal", "quote"),
    [
        (";", ".", ",", ""),
        ("\t", ".", ",", ""),
        (";", ",", ".", ""),
        (",", ",", ".", '"'),
        (",", ".", ",", '"'),
        (";", " ", ",", ""),
        ("\t", "\u202f", ",", ""),
        (",", " ", ".", ""),
        (";", "\u00a0", ".", ""),
        (",", "'", ".", ""),
        (";", "\u2019", ".", ""),
    ],
)
def test_marks_of_thousands(
    delimiter: str, mark: str, decimal: str, quote: str, digits: tuple[int, int, int], read_log: ReadLog
) -> None:
    (record,) = read_log(_log(delimiter, mark, decimal, digits, quote))
    assert (record.dt, record.rows_kept, record.rows_refused) == (pytest.approx(2e-3), 1500, 0)
    np.testing.assert_allclose(record.channels["displacement"], 1e-3 * MOTION, atol=0.6e-3 * 10.0 ** -digits[1])
    np.testing.assert_allclose(record.channels["force"], FORCE, atol=0.6 * 10.0 ** -digits[2])
    assert "thousands" in {f.kind for f in record.findings}


@pytest.mark.parametrize("encoding", ["utf-8", "cp1252", "utf-16"])
def test_whole_numbers_alone_show_their_mark(encoding: str, read_log: ReadLog) -> None:
    text = "Zeit (ms);Kraft (N)\n" + "".join(
        f"{_grouped(t, 0, '.', ',')};{_grouped(f, 0, '.', ',')}\n" for t, f in zip(TIME, FORCE, strict=True)
    )
    (record,) = read_log(text.encode(encoding))
    assert record.dt == pytest.approx(2e-3)
    np.testing.assert_allclose(record.channels["force"], FORCE, atol=0.6)


@pytest.mark.parametrize("digits", [(0, 3, 3), (3, 3, 3), (0, 4, 2)])
@pytest.mark.parametrize(
    ("delimiter", "decimal", "quote"),
    [(";", ".", ""), (";", ",", ""), (",", ".", ""), ("\t", ",", ""), (",", ",", '"'), (";", ",", '"')],
)
def test_plain_numbers_of_three_decimals_keep_their_mark(
    delimiter: str, decimal: str, quote: str, digits: tuple[int, int, int], read_log: ReadLog
) -> None:
    """Forces from 1.234 to 9.876 look like thousands one by one."""
    (record,) = read_log(_log(delimiter, "", decimal, digits, quote))
    np.testing.assert_allclose(record.channels["displacement"], 1e-3 * MOTION, atol=0.6e-3 * 10.0 ** -digits[1])
    assert "thousands" not in {f.kind for f in record.findings}


def test_three_decimals_that_never_fall_below_one_stay_decimals(read_log: ReadLog) -> None:
    rows = "".join(f"{k};{5.0 + 4.0 * np.sin(0.03 * k):.3f}\n" for k in K)
    (record,) = read_log(f"Time (ms);Force (N)\n{rows}")
    assert float(record.channels["force"].max()) == pytest.approx(9.0)
    # whole forces of thousands would be written so, too
    assert [f.text.partition(":")[0] for f in record.findings if f.kind == "decimal-assumed"] == [
        "every number with a '.' has three digits behind it"
    ]


@pytest.mark.parametrize(
    ("delimiter", "mark", "decimal"), [(";", "'", "."), (";", "\u202f", ","), ("\t", ",", "."), (";", ".", ",")]
)
def test_a_force_that_reaches_a_thousand_late_and_seldom_is_read(
    delimiter: str, mark: str, decimal: str, read_log: ReadLog
) -> None:
    force = 990.0 * np.cos(0.025 * K)
    force[700:720] = np.linspace(1001.0, 1777.0, 20)
    rows = (
        delimiter.join([_grouped(t, 3, "", decimal), _grouped(f, 1, mark, decimal)])
        for t, f in zip(TIME, force, strict=True)
    )
    (record,) = read_log("\n".join([f"Time (ms){delimiter}Force (N)", *rows, ""]))
    assert record.rows_refused == 0
    np.testing.assert_allclose(record.channels["force"], force, atol=0.06)


@pytest.mark.parametrize("delimiter", [",", ";", "\t", " "])
@pytest.mark.parametrize("minus", ["\u2212", "\u2013", "\uff0d"])
def test_a_real_minus(minus: str, delimiter: str, read_log: ReadLog) -> None:
    rows = "".join(f"{k * 2e-3:.3f}{delimiter}{f:.2f}\n".replace("-", minus) for k, f in zip(K, FORCE, strict=True))
    (record,) = read_log(f"time_s{delimiter}force_N\n{rows}")
    assert (record.rows_kept, record.rows_refused) == (1500, 0)
    np.testing.assert_allclose(record.channels["force"], FORCE, atol=0.006)


@pytest.mark.parametrize("form", ["{:.6E}", "{:.3e}", " {:12.5E}"])
@pytest.mark.parametrize("letter", ["D", "d"])
@pytest.mark.parametrize("delimiter", [",", " "])
def test_exponents_of_fortran(form: str, letter: str, delimiter: str, read_log: ReadLog) -> None:
    rows = "".join(f"{k * 2e-3:.3f}{delimiter}{form.format(f)}\n" for k, f in zip(K, FORCE, strict=True))
    rows = rows.replace("E", letter).replace("e", letter)
    (record,) = read_log(f"time_s{delimiter}force_N\n{rows}")
    assert (record.rows_kept, record.rows_refused) == (1500, 0)
    np.testing.assert_allclose(record.channels["force"], FORCE, rtol=1e-3)


@pytest.mark.parametrize("negative", ["({})", "{}-"])
@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_negatives_as_accountants_write_them(negative: str, delimiter: str, read_log: ReadLog) -> None:
    texts = [negative.format(f"{-f:.2f}") if f < 0.0 else f"{f:.2f}" for f in FORCE]
    rows = (delimiter.join([f"{t:.0f}", f]) for t, f in zip(TIME, texts, strict=True))
    (record,) = read_log("\n".join([f"Time (ms){delimiter}Force (N)", *rows, ""]))
    np.testing.assert_allclose(record.channels["force"], FORCE, atol=0.006)
    assert record.rows_refused == 0
