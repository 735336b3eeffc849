from collections import Counter

import pytest

from mrfit.core.channels import CHANNELS
from mrfit.ingest.text.layout import TIME_NAMES, aliases_of
from tests.ingest.conftest import ReadLog, read_log

__all__ = ["read_log"]


def test_no_name_means_two_channels_or_time() -> None:
    names = Counter(n for c in CHANNELS.values() for n in {a.replace("_", " ") for a in (c.name, *c.aliases)})
    assert max(names.values()) == 1
    assert not set(names) & TIME_NAMES
    for channel in CHANNELS.values():
        for name in (channel.name, *channel.aliases):
            assert name == name.lower().strip() and aliases_of(name) == [channel.name]


@pytest.mark.parametrize(
    ("header", "found"),
    [
        ("Zeit [s];Weg [mm];Kraft [kN];Strom [A]", "displacement force current"),
        ("Zeit [s];Drehmoment [Nm];Winkel [°];Spannung [V]", "torque angle voltage"),
        ("Tiempo (s);Desplazamiento (mm);Fuerza (kN);Corriente (A)", "displacement force current"),
        ("Temps (s);Déplacement (mm);Force (N);Courant (mA)", "displacement force current"),
        ("Tempo (s);Spostamento (mm);Forza (N);Corrente (A)", "displacement force current"),
        ("zeit_s;weg_mm;kraft_N;geschwindigkeit_mm/s", "displacement force velocity"),
        ("Zeit [s];Kolbenstange Weg [mm];Kraft Zelle 2 [N];Öltemperatur [°C]", "displacement force temperature"),
    ],
)
def test_headers_in_other_languages(header: str, found: str, read_log: ReadLog) -> None:
    rows = "".join(f"{k * 1e-3:.3f};{k % 7};{k % 5};{k % 3}\n" for k in range(60))
    (record,) = read_log(f"{header}\n{rows}")
    assert list(record.channels) == found.split()
    assert [record.units[c] for c in found.split()] == [CHANNELS[c].unit for c in found.split()]


def test_a_pull_is_not_taken_for_a_voltage(read_log: ReadLog) -> None:
    rows = "".join(f"{k * 1e-3:.3f},{k % 7}\n" for k in range(60))
    (record,) = read_log("time [s],tension [N]\n" + rows)
    assert list(record.channels) == ["force"]
