"""Units as FMI and SSP write them, by the powers of SI base units, and as Modelica does."""

from functools import cache

from mrfit.core.channels import unit_factors

# Units of parameters and channels in SI base units, besides which products, quotients and powers are written
_NAMED = {
    "kg": {"kg": 1},
    "m": {"m": 1},
    "s": {"s": 1},
    "A": {"A": 1},
    "K": {"K": 1},
    "degC": {"K": 1},
    "rad": {"rad": 1},
    "Hz": {"s": -1},
    "N": {"kg": 1, "m": 1, "s": -2},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "Wb": {"kg": 1, "m": 2, "s": -2, "A": -1},
    "H": {"kg": 1, "m": 2, "s": -2, "A": -2},
    "ohm": {"kg": 1, "m": 2, "s": -3, "A": -2},
    "S": {"kg": -1, "m": -2, "s": 3, "A": 2},
    "1": {},
}
_OFFSETS = {"degC": 273.15}


@cache
def base_units(unit: str) -> tuple[tuple[str, str], ...]:
    """Return the attributes of a unit's ``BaseUnit``: powers of base units, and its offset; nothing of an unknown one.

    Units are read as pint writes them, left to right: ``N*s/m``, ``ohm/A^2/s``.
    """
    powers: dict[str, int] = {}
    for sign, name, power in unit_factors(unit):
        if name not in _NAMED:
            return ()
        times = int(power or 1) * (-1 if sign == "/" else 1)
        for base, own in _NAMED[name].items():
            powers[base] = powers.get(base, 0) + own * times
    found = [(base, str(power)) for base, power in powers.items() if power]
    return (*found, *((("offset", str(_OFFSETS[unit])),) if unit in _OFFSETS else ()))


@cache
def modelica_unit(unit: str) -> str:
    """Return a unit as Modelica writes it (MLS section 19): ``N.s2/m2`` for ``N*s^2/m^2``, ``Ohm/(A2.s)``."""
    over, under = list[str](), list[str]()
    for sign, name, power in unit_factors(unit):
        written = ("Ohm" if name == "ohm" else name) + power
        (under if sign == "/" else over).append(written)
    over = [f for f in over if f != "1"] or ["1"]
    if not under:
        return ".".join(over)
    below = ".".join(under)
    return f"{'.'.join(over)}/{f'({below})' if len(under) > 1 else below}"
