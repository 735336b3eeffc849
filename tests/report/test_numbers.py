import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrfit.report.numbers import (
    escape_latex,
    in_html,
    natural,
    percent,
    significant,
    unit_html,
    unit_latex,
    with_interval,
)

FINITE = st.floats(-1e12, 1e12, allow_nan=False, allow_subnormal=False)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (0.0123456, "0.0123"),
        (-0.00123456, "-0.00123"),
        (0.000123456, "1.23e-4"),
        (9.996, "10.0"),
        (123456.0, "123456"),
        (1234567.0, "1.23e6"),
        (None, ""),
        (math.nan, ""),
        (math.inf, ""),
    ],
)
def test_significant_digits(value, text):
    assert significant(value) == text


@given(FINITE, st.integers(2, 7))
def test_rounding_errs_by_half_a_unit_of_the_last_digit_at_most(value, digits):
    shown = float(significant(value, digits))
    assert abs(shown - value) <= 0.5 * 10.0 ** (1 - digits) * abs(value) * (1.0 + 1e-9)


def test_interval_decides_the_digits():
    assert with_interval(0.0234567, 0.0232, 0.0237) == ("0.02346", "0.02320", "0.02370")
    assert with_interval(1234.5, 1100.0, 1369.0) == ("1234", "1100", "1369")
    assert with_interval(2.34e-6, 2.30e-6, 2.38e-6) == ("2.340e-6", "2.300e-6", "2.380e-6")


def test_value_without_interval_has_four_digits():
    assert with_interval(20.00083, None, None) == ("20.00", "", "")


def test_value_held_fixed_is_written_out():
    assert with_interval(20.0, 20.0, 20.0) == ("20", "20", "20")
    assert with_interval(1.5e-7, 1.5e-7, 1.5e-7)[0] == "1.5e-7"


def test_interval_wider_than_the_value_keeps_the_value_readable():
    assert with_interval(0.0031, -4.2, 4.3) == ("0.00310", "-4.20", "4.30")


@given(FINITE, st.floats(1e-9, 1e3))
def test_interval_is_resolved(value, share):
    half = max(abs(value), 1e-6) * share
    shown = [float(t) for t in with_interval(value, value - half, value + half)]
    assert shown[1] <= shown[0] <= shown[2]
    if share > 1e-5:
        assert shown[1] < shown[2]


def test_html_has_true_minus_and_powers():
    assert in_html("-1.23e-4") == "−1.23×10⁻⁴"
    assert in_html("") == "–"
    assert percent(0.01234) == "1.23 %"
    assert percent(None) == "– %"


@pytest.mark.parametrize(
    ("unit", "html", "latex"),
    [
        ("N*s/m", "N·s/m", r"N\,s/m"),
        ("m/s^2", "m/s²", "m/s$^{2}$"),
        ("kg*m**2", "kg·m²", r"kg\,m$^{2}$"),
        ("A**-1", "A⁻¹", "A$^{-1}$"),
        ("degC", "°C", r"$^\circ$C"),
        ("ohm", "Ω", r"$\Omega$"),
        ("N/A^1", "N/A", "N/A"),
        ("1", "", ""),
    ],
)
def test_units(unit, html, latex):
    assert (unit_html(unit), unit_latex(unit)) == (html, latex)


def test_latex_specials_are_escaped():
    assert escape_latex("50 % of A&B_1 #2 {x} ~ ^ \\ $") == (
        r"50 \% of A\&B\_1 \#2 \{x\} \textasciitilde{} \textasciicircum{} \textbackslash{} \$"
    )
    assert escape_latex("κ·λ") == r"$\kappa$$\cdot$$\lambda$"


def test_conditions_sort_as_people_sort_them():
    names = ["sine-10Hz-1A", "sine-5Hz-10A", "sine-5Hz-2A", "sine-0.5Hz-2A", "prbs", "sine"]
    assert sorted(names, key=natural) == [
        "prbs",
        "sine",
        "sine-0.5Hz-2A",
        "sine-5Hz-2A",
        "sine-5Hz-10A",
        "sine-10Hz-1A",
    ]
