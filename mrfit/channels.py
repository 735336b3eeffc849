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


CHANNELS: dict[str, Channel] = {
    c.name: c
    for c in (
        Channel("displacement", "m", "x", ("x", "d", "disp", "stroke", "position", "pos", "crosshead", "displacment")),
        Channel("velocity", "m/s", "v", ("v_piston", "vel", "speed", "piston velocity")),
        Channel("acceleration", "m/s^2", "a", ("acc", "accel")),
        Channel("force", "N", "F", ("f", "load", "axial force", "fuerza", "kraft")),
        Channel("current", "A", "i", ("i", "amp", "amps", "coil current", "i_coil", "strom")),
        Channel("voltage", "V", "u", ("u", "v", "volt", "volts", "coil voltage", "u_coil", "spannung")),
        Channel("flux", "Wb", "λ", ("lambda", "flux linkage", "flux_linkage", "λ", "linkage")),
        Channel("temperature", "degC", "T", ("t_oil", "temp", "oil temperature")),
        Channel("angle", "rad", "θ", ("theta", "rotation")),
        Channel("angular_velocity", "rad/s", "ω", ("omega", "angular velocity", "angular speed")),
        Channel("angular_acceleration", "rad/s^2", "α", ("angular acceleration",)),
        Channel("torque", "N*m", "T", ("moment",)),
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
