import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrfit.ingest.meaning import units


@pytest.mark.parametrize(
    ("text", "unit", "scale", "offset"),
    [
        ("mm", "m", 1e-3, 0.0),
        ("cm", "m", 1e-2, 0.0),
        ("in", "m", 0.0254, 0.0),
        ("mil", "m", 2.54e-5, 0.0),
        ("kN", "N", 1e3, 0.0),
        ("kgf", "N", 9.80665, 0.0),
        ("lbf", "N", 4.4482216152605, 0.0),
        ("mV", "V", 1e-3, 0.0),
        ("Volt", "V", 1.0, 0.0),
        ("mA", "A", 1e-3, 0.0),
        ("ms", "s", 1e-3, 0.0),
        ("µs", "s", 1e-6, 0.0),
        ("(ms)", "s", 1e-3, 0.0),
        ("S", "s", 1.0, 0.0),
        ("mm/s", "m/s", 1e-3, 0.0),
        ("m/s²", "m/s^2", 1.0, 0.0),
        ("g", "m/s^2", 9.80665, 0.0),
        ("mWb", "Wb", 1e-3, 0.0),
        ("V*s", "Wb", 1.0, 0.0),
        ("Vs", "Wb", 1.0, 0.0),
        ("°C", "degC", 1.0, 0.0),
        ("°F", "degC", 5 / 9, -160 / 9),
        ("C", "degC", 1.0, 0.0),
        ("℃", "degC", 1.0, 0.0),
        ("degrees C", "degC", 1.0, 0.0),
        ("Inches", "m", 0.0254, 0.0),
        ("ips", "m/s", 0.0254, 0.0),
        ("MM/S", "m/s", 1e-3, 0.0),
        ("IN/S", "m/s", 0.0254, 0.0),
        ("M/S2", "m/s^2", 1.0, 0.0),
        ("V/A", "ohm", 1.0, 0.0),
        ("A/M", "A/m", 1.0, 0.0),
        ("Millimeters", "m", 1e-3, 0.0),
        ("KILONEWTON", "N", 1e3, 0.0),
        ("LBF", "N", 4.4482216152605, 0.0),
        ("Kn", "N", 1e3, 0.0),
        ("k N", "N", 1e3, 0.0),
        ("kilos", "N", 9.80665, 0.0),
        ("N, LP 100 Hz", "N", 1.0, 0.0),
        ("千牛", "N", 1e3, 0.0),
        ("ma", "A", 1e-3, 0.0),
        ("Amp.", "A", 1.0, 0.0),
        ("mS", "s", 1e-3, 0.0),
        ("mseg", "s", 1e-3, 0.0),
        ("Grad C", "degC", 1.0, 0.0),
        ("\ufffdC", "degC", 1.0, 0.0),  # a degree sign in an encoding that nobody knows
        ("INCH", "m", 0.0254, 0.0),
        ("milímetros", "m", 1e-3, 0.0),
        ("mm·s⁻¹", "m/s", 1e-3, 0.0),
        ("m s⁻²", "m/s^2", 1.0, 0.0),
        ("Adc", "A", 1.0, 0.0),
        ("mm; AVE", "m", 1e-3, 0.0),
        ("кН", "N", 1e3, 0.0),
        ("мм/с", "m/s", 1e-3, 0.0),
        ("deg", "rad", math.pi / 180, 0.0),
        ("rpm", "rad/s", math.pi / 30, 0.0),
        ("Nm", "N*m", 1.0, 0.0),
        ("psi", "Pa", 6894.757293168, 0.0),
        ("MPa", "Pa", 1e6, 0.0),
        ("cycles", "1", 1.0, 0.0),
        ("G", "T", 1e-4, 0.0),
        ("kG", "T", 0.1, 0.0),
        ("Gauss", "T", 1e-4, 0.0),
        ("m/s2", "m/s^2", 1.0, 0.0),
        ("m/s^2", "m/s^2", 1.0, 0.0),
        ("mm/s2", "m/s^2", 1e-3, 0.0),
        ("Ohm", "ohm", 1.0, 0.0),
        ("kOhm", "ohm", 1e3, 0.0),
        ("Ω", "ohm", 1.0, 0.0),
        ("KN", "N", 1e3, 0.0),
        ("PSI", "Pa", 6894.757293168, 0.0),
        ("RPM", "rad/s", math.pi / 30, 0.0),
        ("HZ", "Hz", 1.0, 0.0),
        ("mv", "V", 1e-3, 0.0),
        ("MM", "m", 1e-3, 0.0),
        ("1/min", "Hz", 1.0 / 60.0, 0.0),
    ],
)
def test_laboratory_units_to_si(text: str, unit: str, scale: float, offset: float) -> None:
    found = units.to_si(text)
    assert found.unit == unit
    assert found.scale == pytest.approx(scale, rel=1e-12)
    assert found.offset == pytest.approx(offset, abs=1e-9)


def test_kelvin_becomes_celsius_where_a_temperature_is_asked() -> None:
    found = units.to_unit("K", "degC")
    assert (found.scale, found.offset) == (pytest.approx(1.0), pytest.approx(-273.15))


@pytest.mark.parametrize("text", ["furlongs/blink", "12", "Comment", "?", "a" * 50, "__import__('os')"])
def test_other_texts_are_no_units(text: str) -> None:
    assert not units.known(text)


@pytest.mark.parametrize(
    ("text", "unit", "fits"),
    [
        ("mm", "V", False),
        ("kN", "N", True),
        ("deg", "1", False),
        ("deg", "rad", True),
        ("Hz", "rad/s", False),
        ("rpm", "rad/s", True),
        ("%", "1", True),
        ("nonsense", "m", False),
    ],
)
def test_compatible(text: str, unit: str, fits: bool) -> None:
    assert units.compatible(text, unit) is fits


def test_quantities_with_units() -> None:
    assert units.quantity("-12.0mV") == (-12.0, "mV")
    assert units.quantity("160000Hz") == (160000.0, "Hz")
    assert units.quantity("CH1") is None
    assert units.seconds("4 us") == pytest.approx(4e-6)
    assert units.seconds("4 V") is None


@pytest.mark.parametrize(
    "text",
    ["N**9**9**9", "N^9^9^9", "((m^9)^9)^9", "(m^9)^9**9", "m^999", "N*9**9**9", "m^(9**9**9)", "m squared cubed"]
    + ["Qm^99", "m//s", "m^", "^2", "m**", "m)/s", "m/()", "N[0]"],
)
def test_what_is_not_built_as_a_unit_never_reaches_pint(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """pint works out a power of powers, which has more digits than there is time to make."""
    if text != "Qm^99":  # built as a unit is, but beyond all numbers
        monkeypatch.setattr(units, "_registry", lambda: pytest.fail("pint was asked"))
    units.known.cache_clear()
    assert not units.known(text)


@pytest.mark.parametrize(
    ("text", "unit", "scale"),
    [
        ("kg*m**2/s**3", "W", 1.0),
        ("kg m^2 s^-2", "N*m", 1.0),
        ("m ^ 2 / s ^ 2", "m^2/s^2", 1.0),
        ("V/Hz^0.5", "", 1.0),
        ("cubic meter", "m^3", 1.0),
        ("mm squared", "m^2", 1e-6),
        ("N s/m", "kg/s", 1.0),
    ],
)
def test_units_of_several_factors_are_read_as_before(text: str, unit: str, scale: float) -> None:
    assert units.known(text)
    found = units.to_si(text)
    assert found.scale == pytest.approx(scale)
    assert not unit or found.unit.replace(" ", "") in (unit, unit.replace("N*m", "J"))


PIECES = ["m", "s", "N", "kV", "/", "*", "**", "^", " ", "(", ")", "1", "2", "9", "-", ".5", "squared", "é", "\0", "%"]


@settings(max_examples=100, deadline=2000)
@given(st.lists(st.sampled_from(PIECES), max_size=12).map("".join))
def test_any_text_is_a_unit_or_none_soon(text: str) -> None:
    if units.known(text):
        assert math.isfinite(units.to_si(text).scale)


@pytest.mark.parametrize(("text", "unit", "scale"), [("Âµm", "m", 1e-6), ("mm/S", "m/s", 1e-3), ("Â°C", "degC", 1.0)])
def test_units_damaged_by_an_encoding_or_in_capitals(text: str, unit: str, scale: float) -> None:
    assert units.to_unit(text, unit).scale == pytest.approx(scale)
