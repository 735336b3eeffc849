"""The physical channels mrfit knows: canonical name, SI unit, symbol, and the names laboratories give them."""

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
    "spostamento, posizione",
    "velocity": "geschwindigkeit, velocidad, vitesse, velocità, velocita",
    "acceleration": "beschleunigung, aceleración, aceleracion, accélération, accelerazione",
    "force": "kraft, fuerza, forza",
    "current": "strom, spulenstrom, corriente, courant, corrente",
    # not tension, tensión, tensione: a voltage in one language, a pull in the other
    "voltage": "spannung, spulenspannung, voltaje, voltaggio",
    "flux": "flussverkettung",
    "temperature": "temperatur, öltemperatur, temperatura, température",
    "angle": "winkel, drehwinkel, ángulo, angulo, angolo",
    "angular_velocity": "winkelgeschwindigkeit, velocidad angular, vitesse angulaire, velocità angolare",
    "torque": "drehmoment, momento, coppia, couple",
}
"""Names in German, Spanish, French and Italian; none that means something else in another of them or in English."""

CHANNELS: dict[str, Channel] = {
    name: Channel(name, unit, symbol, (*aliases, *filter(None, ABROAD.get(name, "").split(", "))))
    for name, unit, symbol, aliases in (
        ("displacement", "m", "x", ("x", "d", "disp", "stroke", "position", "pos", "crosshead", "displacment")),
        ("velocity", "m/s", "v", ("v_piston", "vel", "speed", "piston velocity")),
        ("acceleration", "m/s^2", "a", ("acc", "accel")),
        ("force", "N", "F", ("f", "load", "axial force")),
        ("current", "A", "i", ("i", "amp", "amps", "coil current", "i_coil")),
        ("voltage", "V", "u", ("u", "v", "volt", "volts", "coil voltage", "u_coil")),
        ("flux", "Wb", "λ", ("lambda", "flux linkage", "flux_linkage", "λ", "linkage")),
        ("temperature", "degC", "T", ("t_oil", "temp", "oil temperature")),
        ("angle", "rad", "θ", ("theta", "rotation")),
        ("angular_velocity", "rad/s", "ω", ("omega", "angular velocity", "angular speed")),
        ("angular_acceleration", "rad/s^2", "α", ("angular acceleration",)),
        ("torque", "N*m", "T", ("moment",)),
    )
}


def unit_of(name: str) -> str:
    """Return the SI unit of a canonical channel, or the empty string for a channel no map has named."""
    channel = CHANNELS.get(name)
    return channel.unit if channel else ""


def symbol_of(name: str) -> str:
    """Return the symbol of a canonical channel, or the name itself for any other."""
    channel = CHANNELS.get(name)
    return channel.symbol if channel else name
