import pytest

from mrfit.ingest.refusal import Refusal
from tests.ingest.conftest import ReadLog
from tests.ingest.samples import leybold_cassy


def test_names_and_units_inside_def(read_log: ReadLog) -> None:
    data = leybold_cassy().data.replace(b'"Weg" s_A1 / m', b'"Weg" s_A1 / cm')
    (record,) = read_log(data)
    assert record.units == {"displacement": "m", "voltage": "V"}
    assert abs(record.channels["displacement"]).max() < 0.03


def test_quantity_without_unit_keeps_its_name(read_log: ReadLog) -> None:
    (record,) = read_log(leybold_cassy().data.replace(b'"Spannung" U_B1 / V', b'"Zahl" n'))
    assert set(record.channels) == {"displacement", "zahl"}


def test_time_without_unit_is_refused(read_log: ReadLog) -> None:
    with pytest.raises(Refusal, match="gives the first quantity no unit"):
        read_log(leybold_cassy().data.replace(b'"Zeit" t / s', b'"Zeit" t'))
