from collections import Counter

import pytest

from mrfit.core.channels import (
    ANTIDERIVATIVES,
    CHANNELS,
    DRIVING,
    EXCITATIONS,
    INTEGRALS,
    MOTION,
    MOTION_OF_MASS,
    OUTPUT_ON_MASS,
    WORK_AGAINST,
    symbol_of,
    unit_factors,
    unit_of,
)
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


# Powers of kg, m, s, A and K that make up what the units of channels are written with; an angle has none
DIMENSIONS = {
    **{"m": (0, 1, 0, 0, 0), "s": (0, 0, 1, 0, 0), "A": (0, 0, 0, 1, 0), "N": (1, 1, -2, 0, 0)},
    **{"V": (1, 2, -3, -1, 0), "Wb": (1, 2, -2, -1, 0), "T": (1, 0, -2, -1, 0)},
    **{"rad": (0, 0, 0, 0, 0), "degC": (0, 0, 0, 0, 1)},
}


def dimensions(unit: str) -> tuple[int, ...]:
    """Powers of the base units in a unit as channels have it."""
    found = [0] * 5
    for sign, name, power in unit_factors(unit):
        times = int(power or 1) * (-1 if sign == "/" else 1)
        found = [total + times * own for total, own in zip(found, DIMENSIONS[name], strict=True)]
    return tuple(found)


def per_second(unit: str, order: int) -> tuple[int, ...]:
    """Powers of a unit's derivative of an order in time."""
    kg, m, s, a, k = dimensions(unit)
    return (kg, m, s - order, a, k)


def test_a_unit_is_read_as_its_factors_with_their_powers() -> None:
    assert unit_factors("N*s^2/m") == [("", "N", ""), ("*", "s", "2"), ("/", "m", "")]
    assert unit_factors("1/s^-1") == [("", "1", ""), ("/", "s", "-1")]
    assert dimensions("N") == dimensions("V*A*s/m")


def test_a_channel_has_the_unit_of_the_derivative_that_it_is() -> None:
    rows = [(name, of, order) for name, parts in ANTIDERIVATIVES.items() for of, order in parts]
    rows += [(rate, of, 1) for of, rate in INTEGRALS.items()]
    for place, speed, acceleration in MOTION.values():
        rows += [(speed, place, 1), (acceleration, place, 2)]
    for name, of, order in rows:
        assert dimensions(unit_of(name)) == per_second(unit_of(of), order), (name, of)
    for name, order in DRIVING.items():
        place = "current" if name == "current" else "angle" if "ang" in name else "displacement"
        assert dimensions(unit_of(name)) == per_second(unit_of(place), order)
    # the absolute acceleration of a mass on a base that moves is one like its own
    displaced, *derived, absolute = MOTION_OF_MASS
    for order, name in enumerate(derived, 1):
        assert dimensions(unit_of(name)) == per_second(unit_of(displaced), order)
    assert unit_of(absolute) == unit_of(derived[-1]) == unit_of(EXCITATIONS["base"])


def test_an_output_times_what_it_works_against_is_an_energy() -> None:
    for output, (against, rate) in WORK_AGAINST.items():
        product = zip(dimensions(unit_of(output)), dimensions(unit_of(against)), strict=True)
        assert tuple(a + b for a, b in product) == dimensions("N*m"), output
        assert not rate or dimensions(unit_of(rate)) == per_second(unit_of(against), 1)
    assert unit_of(EXCITATIONS["force"]) == unit_of(OUTPUT_ON_MASS)


def test_a_channel_that_no_map_has_named_has_its_own_name_and_no_unit() -> None:
    assert (unit_of("flux"), symbol_of("flux")) == ("Wb", "λ")
    assert (unit_of("strain"), symbol_of("strain")) == ("", "strain")
