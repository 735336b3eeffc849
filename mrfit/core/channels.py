"""The physical channels mrfit knows: canonical name, SI unit, symbol, the names laboratories give them, their kinship.

Fits, searches and discoveries know no channel by name: what they need to know of one stands here.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Channel:
    """One physical quantity.

    Attributes
    ----------
    name
        Canonical channel name, as in Parquet columns and model inputs.
    unit
        SI unit of the stored values, in pint's spelling.
    symbol
        Symbol on figure axes.
    aliases
        Lower-case words by which a header may call it.
    """

    name: str
    unit: str
    symbol: str
    aliases: tuple[str, ...] = ()


ABROAD = {
    "displacement": "weg, verschiebung, auslenkung, desplazamiento, posición, posicion, déplacement, deplacement, "
    "spostamento, posizione, перемещение, ход, 位移, 変位, ストローク, 변위",
    "velocity": "geschwindigkeit, velocidad, vitesse, velocità, velocita, скорость, 速度, 속도",
    "acceleration": "beschleunigung, aceleración, aceleracion, accélération, accelerazione, ускорение, 加速度, 가속도",
    "force": "kraft, fuerza, forza, сила, усилие, нагрузка, 力, 阻尼力, 载荷, 荷重, 減衰力, 하중, 힘",
    "current": "strom, spulenstrom, corriente, courant, corrente, ток, сила тока, 电流, 電流, 전류",
    # not tension, tensión, tensione: a voltage in one language, a pull in the other
    "voltage": "spannung, spulenspannung, voltaje, voltaggio, напряжение, 电压, 電圧, 전압",
    "flux": "flussverkettung, 磁链",
    "temperature": "temperatur, öltemperatur, temperatura, température, температура, 温度, 油温, 온도",
    "angle": "winkel, drehwinkel, ángulo, angulo, angolo, угол, 角度, 转角, 각도",
    "angular_velocity": "winkelgeschwindigkeit, velocidad angular, vitesse angulaire, velocità angolare, "
    "角速度, 각속도",
    "torque": "drehmoment, momento, coppia, couple, 扭矩, 转矩, トルク, 토크",
}
"""Names in German, Spanish, French, Italian, Russian, Chinese, Japanese and Korean.

None means something else in another of them or in English.
"""

CHANNELS: dict[str, Channel] = {
    name: Channel(name, unit, symbol, (*aliases, *filter(None, ABROAD.get(name, "").split(", "))))
    for name, unit, symbol, aliases in (
        ("displacement", "m", "x", ("x", "d", "disp", "stroke", "position", "pos", "crosshead", "displacment")),
        ("velocity", "m/s", "v", ("v_piston", "vel", "speed", "piston velocity")),
        ("acceleration", "m/s^2", "a", ("acc", "accel")),
        ("force", "N", "F", ("f", "load", "axial force")),
        ("current", "A", "i", ("i", "curr", "amp", "amps", "coil current", "i_coil")),
        ("voltage", "V", "u", ("u", "v", "volt", "volts", "coil voltage", "u_coil")),
        ("flux", "Wb", "λ", ("lambda", "flux linkage", "flux_linkage", "λ", "linkage")),
        ("field_strength", "A/m", "H", ("h", "magnetic field strength", "magnetic field", "feldstärke")),
        ("flux_density", "T", "B", ("b", "magnetic flux density", "induction", "flussdichte", "induktion")),
        ("temperature", "degC", "T", ("t_oil", "temp", "oil temperature")),
        ("angle", "rad", "θ", ("theta", "rotation")),
        ("angular_velocity", "rad/s", "ω", ("omega", "angular velocity", "angular speed")),
        ("angular_acceleration", "rad/s^2", "α", ("angular acceleration",)),
        ("torque", "N*m", "T", ("moment",)),
        # a column of force or acceleration whose name says no more is that of the specimen, above
        ("absolute_acceleration", "m/s^2", "a_abs", ("absolute acceleration", "total acceleration")),
        ("excitation_force", "N", "u", ("excitation force", "exciting force", "shaker force")),
        ("base_acceleration", "m/s^2", "a_g", ("base acceleration", "ground acceleration", "table acceleration")),
    )
}

LARGEST: Mapping[str, float] = {
    **{"displacement": 20.0, "velocity": 300.0, "acceleration": 1e6, "force": 1e8, "torque": 1e8},
    **{"current": 1e4, "voltage": 1e5, "flux": 1e3, "flux_density": 100.0, "temperature": 3000.0},
}
"""Size, in the SI unit, that a channel of no damper and no coil exceeds."""
COLDEST = -120.0
"""Temperature in degC below which no damper works."""

ANTIDERIVATIVES: Mapping[str, tuple[tuple[str, int], ...]] = {
    "velocity": (("displacement", 1),),
    "acceleration": (("velocity", 1), ("displacement", 2)),
    "angular_velocity": (("angle", 1),),
    "angular_acceleration": (("angular_velocity", 1), ("angle", 2)),
}
"""What a channel is the derivative of, and of which order: it is computed where it was not recorded."""

INTEGRALS: Mapping[str, str] = {"displacement": "velocity"}
"""Channel -> its rate, from whose integral its course about its middle is known where it was not recorded."""

LEVEL_CHANNELS = ("current", "temperature")
"""Channels that are held at a level, or drift: constant where they were not recorded."""

FAST_INPUTS = ("current", "displacement", "angle")
"""Inputs that change within a cycle."""

DRIVING: Mapping[str, int] = {"displacement": 0, "angle": 0, "velocity": 1, "angular_velocity": 1, "current": 0}
"""Channels that may drive a specimen -> the order of derivative that each is of the motion."""

DRIVING_MOTIONS = tuple(name for name in DRIVING if name not in LEVEL_CHANNELS)
"""Those of them that are a motion."""

EXCITATIONS: Mapping[str, str] = {"force": "excitation_force", "base": "base_acceleration"}
"""What drives a mass, as it is written -> its channel."""

MOTION_OF_MASS = ("displacement", "velocity", "acceleration", "absolute_acceleration")
"""Motion of a mass that is driven, in the order of derivatives; the last beside that of the base."""

OUTPUT_ON_MASS = "force"
"""What a law gives on which a mass is driven."""

UNIT_NEEDED = ("base_acceleration", "absolute_acceleration")
"""Channels that no column without a unit is mapped to."""

WORK_AGAINST: Mapping[str, tuple[str, str]] = {
    "flux": ("current", ""),
    "current": ("flux", ""),
    "force": ("displacement", "velocity"),
    "torque": ("angle", "angular_velocity"),
}
"""Output -> the channel it does work against, and that channel's rate."""

MOTION: Mapping[str, tuple[str, str, str]] = {
    "force": ("displacement", "velocity", "acceleration"),
    "torque": ("angle", "angular_velocity", "angular_acceleration"),
}
"""Output -> place, speed and acceleration of the motion that makes it."""

POSITIONS = tuple(motion[0] for motion in MOTION.values())
"""Where in its motion a specimen is."""

CONTROL = "current"
"""The input by which a law is changed during a test."""

ELECTRICAL = ("current", "voltage")
"""Channels of a coil that is switched off at zero."""

WARMTH = "temperature"
"""The channel that tells how warm the specimen is."""

LOCATED_BY = ("displacement", "velocity", "current", "temperature")
"""Channels by which it is said where an error lies, whether or not the model needs them."""

STATE_CHANNELS = ("current", "displacement", "velocity", "acceleration", "temperature")
"""What a model without physics takes as input."""

REMEMBERED = ("current", "velocity")
"""Channels of the state whose past it is told too."""

LOOP_AXES = ("velocity", "angular_velocity", "current", "displacement", "angle")
"""Channels over which people draw loops, in the order in which they are named where two fit alike."""

MISSING_CHANNEL_ADVICE: Mapping[str, str] = {
    "flux": "give coil voltage and current in the channel map so that `mrfit flux` can reconstruct it",
}
"""What to do where a log lacks an output, if it is not to name its column."""


def unit_of(name: str) -> str:
    """Return the SI unit of a canonical channel, or the empty string for a channel no map has named."""
    channel = CHANNELS.get(name)
    return channel.unit if channel else ""


def unit_factors(unit: str) -> list[tuple[str, str, str]]:
    """Return (``*``, ``/`` or nothing; name; power as written) of a unit's factors, as pint writes it: ``N*s^2/m``."""
    return re.findall(r"([*/]?)([A-Za-z]+|1)(?:\^(-?\d+))?", unit)


def symbol_of(name: str) -> str:
    """Return the symbol of a canonical channel, or the name itself for any other."""
    channel = CHANNELS.get(name)
    return channel.symbol if channel else name
