"""Units as laboratories write them, to SI; the only place that knows pint."""

import math
import re
from dataclasses import dataclass
from functools import cache
from typing import Any

from mrfit.core.channels import CHANNELS

_WRITTEN = {
    "1": "|-|no|nr|cycle|cycles|segment|segments|count|counts",
    "V": "volt|volts|v dc|в|伏",
    "A": "amp|amps|ampere|amperes|a dc|а|安|安培",
    "s": "s|sec|secs|second|seconds|sek|seg|segundos|sekunde|sekunden|secondes|secondi|saniye|sn|с|сек|秒",
    "ms": "millisekunden|msec|mseg|milliseconds|мс|毫秒",
    "us": "usec|microseconds|微秒",
    "minute": "minutes|mins",
    "hour": "hours|hrs",
    "day": "days",
    "N": "newton|newtons|н|牛|牛顿",
    "kN": "k n|кн|千牛",
    "mA": "mamp|mamps|milliamp|milliamps|ма|毫安",
    "m": "米",
    "mm": "millimètres|milímetros|мм|毫米",
    "mm/s": "мм/с|毫米/秒",
    "N*m": "nm|n.m|n-m",
    "V*s": "vs|v.s",
    "mV*s": "mvs",
    "Wb": "wb-t",
    "degC": "c|degc|deg c|deg_c|deg. c|oc|'c|�c|¡c|°c|ºc|℃|celsius|degrees c|degree c|grad c|grad celsius"
    "|grados c|摄氏度",
    "degF": "f|degf|deg f|deg_f|°f|ºf|℉|fahrenheit|degrees f|degree f",
    "deg": "°|º|degrees",
    "percent": "%",
    "lb": "pounds",
    "kgf": "kgf|kg-f|kp|kgw|kilos|公斤|公斤力",
    "lbf": "lbs",
    "Hz": "hz|1/s",
    "kHz": "khz",
    "psi": "psi",
    "rpm": "rpm",
    "min^-1": "1/min",
    "flux_gauss": "gauss",
    "field_oersted": "oersted|oe",
    "kilofield_oersted": "koe",
    "ohm": "ω",
    "m/s": "mps|м/с",
    "inch": 'in|"|inch|inches',
    "inch/s": "ips",
    "thou": "mil|mils",
}
SPELLINGS = {
    **{text: unit for unit, texts in _WRITTEN.items() for text in texts.split("|")},
    **{f"{w}{mark}ft": "foot*lbf" for w in ("lb", "lbf") for mark in ("", "-", ".", " ")},
    **{f"ft{mark}{w}": "foot*lbf" for w in ("lb", "lbs", "lbf") for mark in ("", "-", ".", " ")},
    **{f"{w}{mark}in": "inch*lbf" for w in ("lb", "lbf") for mark in ("", "-", ".", " ")},
    **{f"in{mark}{w}": "inch*lbf" for w in ("lb", "lbs", "lbf") for mark in ("", "-", ".", " ")},
}
UNIT_SIGNS = str.maketrans(
    {
        **{"\u03bc": "u", "\u00b5": "u", "·": "*", "\u22c5": "*", "\u03a9": "ohm", "\u2126": "ohm"},
        **{"Â": "", "²": "^2", "³": "^3", "¹": "^1", "⁻": "^-"},
    }
)
CASE_SENSITIVE = {
    **{"S": "s", "MPa": "MPa", "mN": "mN", "MN": "MN", "nm": "nm", "Nm": "N*m", "kNm": "kN*m", "Nmm": "N*mm"},
    **{"g": "standard_gravity", "G": "flux_gauss", "kG": "kiloflux_gauss", "mG": "milliflux_gauss", "Gs": "flux_gauss"},
    **{"Adc": "A", "Vdc": "V"},
    # no unit, or absurd, as written
    **{
        "MM": "mm",
        "CM": "cm",
        "KN": "kN",
        "Kn": "kN",
        "KV": "kV",
        "Kg": "kg",
        "mv": "mV",
        "ma": "mA",
        "kn": "kN",
        "a": "A",
    },
    **{"mS": "ms", "MS": "ms", "uS": "us", "US": "us"},
}
WEIGHTS = {"lb": "lbf", "pound": "lbf", "klb": "kip", "oz": "ozf", "kg": "kgf"}
"""Units of mass that test machines print for forces."""
SINCE = re.compile(
    r"\s+since\b.*|\s*[;,]\s*(?:ave|avg|act|actual|raw|filtered|lp\b.*|low-?pass\b.*)$|(?<=[a-z])\.$",
    re.IGNORECASE | re.DOTALL,
)
"""What follows a unit in ``days since 2024-01-01``, ``mm; AVE``, ``N, LP 100 Hz`` and ``Amp.``."""
CAPITALS_FOR_SMALL = {"M", "IN", "FT", "DEG", "RAD", "MIN", "SEC", "LBF", "KGF", "REV", "INCH"}
RATIO_IN_CAPITALS = re.compile(r"[A-Z]+/[A-Z]+2?")
UNITS_IN_FULL = re.compile(
    r"(?:micro|milli|centi|kilo)?(?:met(?:er|re)|newton|ampere|volt|second|gram|hertz|pascal|watt|joule|pound)s?|lbf|kips?",
    re.IGNORECASE,
)
"""Words that pint knows in lower-case letters alone."""
TEMPERATURE_UNITS = ("degC", "degF")
SI = ("m", "s", "A", "V", "N", "Wb", "Pa", "m/s", "m/s^2", "K", "N*m", "ohm", "H", "T", "W", "Hz", "kg", "m^3", "A/m")
ANGLES = re.compile(r"rad|deg|°|rpm|rev|turn", re.IGNORECASE)
LONGEST_UNIT = 24
UNIT_POWER = r"(?:(?:\*\*|\^)-?\d\d?(?:\.\d)?)?"
UNIT_FACTOR = re.compile(rf"(?:1|[A-Za-z°%Ωµ_][A-Za-z0-9°%Ωµ._-]*){UNIT_POWER}")
"""A factor of a unit: one, or a word; perhaps to a power of two digits."""
BRACKET = re.compile(rf"\(([^()]*)\){UNIT_POWER}")
OPERATOR = re.compile(r" *(\*\*|[*/^]) *")
UNIT_FACTORS_BETWEEN = re.compile(r"(?<!\*)\*(?!\*)|[/ ]")
WORDS_OF_POWER = re.compile(r"\b(?:squared?|sq|cubed|cubic)\b", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Conversion:
    """value_SI = scale · value + offset, in ``unit``."""

    unit: str
    scale: float = 1.0
    offset: float = 0.0


@cache
def _registry() -> Any:
    import pint

    registry: Any = pint.UnitRegistry(autoconvert_offset_to_baseunit=True)
    registry.define("windows_tick = 1e-7 second")
    # pint's own gauss and oersted are of the CGS system, and no part of a tesla or of A/m
    registry.define("flux_gauss = 1e-4 tesla")
    registry.define("field_oersted = 1000 / (4 * pi) * ampere / meter")
    return registry


@cache
def spelled(text: str) -> str:
    """Return a unit in pint's spelling, without asking whether pint knows it."""
    bare = SINCE.sub("", text.strip().strip("[](){}").strip().translate(UNIT_SIGNS)).replace("^-^", "^-")
    if bare in CASE_SENSITIVE:
        return CASE_SENSITIVE[bare]
    bare = re.sub(r"ohms?$", "ohm", bare, flags=re.IGNORECASE)
    if RATIO_IN_CAPITALS.fullmatch(bare):
        bare = "/".join(_in_small_letters(part) for part in bare.split("/"))
    elif UNITS_IN_FULL.fullmatch(bare):
        bare = bare.lower()
    bare = re.sub(r"(/[a-z]+)([23])$", r"\1^\2", re.sub("/S$", "/s", bare))  # m/s2
    return SPELLINGS.get(bare.lower(), bare)


def _in_small_letters(part: str) -> str:
    """Return a factor of a unit as it is written elsewhere; symbols that are capital letters stay."""
    symbol = part.rstrip("2")
    small = symbol.lower() if symbol in CAPITALS_FOR_SMALL else symbol
    return CASE_SENSITIVE.get(symbol, small) + part[len(symbol) :]


@cache
def known(text: str) -> bool:
    """Whether a text is a unit."""
    unit = spelled(text)
    if unit == "1" or unit in SI or unit in TEMPERATURE_UNITS:
        return True
    if not _is_plain(unit):
        return False
    try:
        registry = _registry()
        registry.Unit(unit)
        size = float(registry.Quantity(1.0, unit).to_base_units().magnitude)
    except Exception:  # pint raises whatever its tokenizer meets
        return False
    return math.isfinite(size)


def _is_plain(unit: str) -> bool:
    """Whether a text is built as a unit is: a few factors, each to a small power.

    pint works out whatever it is given, and a power of powers has more digits than there is time to make.
    """
    if len(unit) > LONGEST_UNIT or unit[:1].isdigit() or len(WORDS_OF_POWER.findall(unit)) > 1:
        return False
    unit, powers = OPERATOR.sub(r"\1", unit), 0
    while match := BRACKET.search(unit):
        powers += not match[0].endswith(")")
        if powers > 1 or not _is_product(match[1]):
            return False
        unit = f"{unit[: match.start()]}x{unit[match.end() :]}"
    return _is_product(unit)


def _is_product(text: str) -> bool:
    return all(UNIT_FACTOR.fullmatch(factor) for factor in UNIT_FACTORS_BETWEEN.split(text))


@cache
def compatible(text: str, unit: str) -> bool:
    """Whether a unit can be converted to ``unit``."""
    written = _meant(spelled(text), unit)
    if written == unit:
        return True
    if unit in TEMPERATURE_UNITS and "delta" in written.lower():
        return False
    if "rad" in unit or unit == "1":  # pint takes an angle for a pure number
        return bool(ANGLES.search(written)) == ("rad" in unit) and _same_dimension(written, unit)
    return _same_dimension(written, unit)


def is_weight(text: str) -> bool:
    """Whether a unit is one of mass, and that of a force where a column is called one."""
    return spelled(text) in WEIGHTS


def _meant(written: str, unit: str) -> str:
    return WEIGHTS.get(written, written) if unit == "N" else written


def _same_dimension(written: str, unit: str) -> bool:
    if not known(written):
        return False
    registry = _registry()
    return bool(registry.Unit(_plain(written)).dimensionality == registry.Unit(_plain(unit)).dimensionality)


def _plain(unit: str) -> str:
    return "dimensionless" if unit == "1" else unit


@cache
def to_unit(text: str, unit: str) -> Conversion:
    """Return the conversion from a written unit to ``unit``; both must be compatible."""
    written = _meant(spelled(text), unit)
    if written == unit:
        return Conversion(unit)
    quantity = _registry().Quantity
    zero = quantity(0.0, _plain(written)).to(_plain(unit)).magnitude
    one = quantity(1.0, _plain(written)).to(_plain(unit)).magnitude
    if written not in TEMPERATURE_UNITS and unit not in TEMPERATURE_UNITS:
        return Conversion(unit, float(one))
    return Conversion(unit, float(one - zero), float(zero))


@cache
def to_si(text: str) -> Conversion:
    """Return the conversion from a written unit to the SI unit of its kind."""
    written = spelled(text)
    if written == "1" or written in SI:
        return Conversion(written)
    if written in TEMPERATURE_UNITS:
        return to_unit(written, "degC")
    if written in WEIGHTS:
        return to_unit(written, "kg")
    if ANGLES.search(written) and compatible(written, "rad"):
        return to_unit(written, "rad")
    if ANGLES.search(written) and compatible(written, "rad/s"):
        return to_unit(written, "rad/s")
    for unit in SI:
        if compatible(written, unit):
            return to_unit(written, unit)
    whole = _registry().Quantity(1.0, written).to_base_units()
    return Conversion(f"{whole.units:~C}".replace("**", "^"), float(whole.magnitude))


def contradict(one: str, other: str) -> bool:
    """Whether two known units are of one kind and of different size."""
    first, second = to_si(one), to_si(other)
    if {first.unit, second.unit} == {"K", "degC"}:
        return True
    return first.unit == second.unit and first != second


def channels_of(text: str) -> list[str]:
    """Return the canonical channels a written unit can belong to."""
    return [c.name for c in CHANNELS.values() if compatible(text, c.unit)]


def quantity(text: str) -> tuple[float, str] | None:
    """Return number and unit of a text such as ``-12.0mV`` or ``160000Hz``, or None."""
    match = re.fullmatch(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([A-Za-zµμ°%/]*)\s*", text)
    return (float(match[1]), match[2]) if match else None


def seconds(text: str) -> float | None:
    """Return the seconds of a text such as ``1.6e-06``, ``4 ms`` or ``2.5us``; None if it is no time."""
    found = quantity(text)
    if found is None or not compatible(found[1] or "s", "s"):
        return None
    return found[0] * to_unit(found[1] or "s", "s").scale
