"""What can be hidden, how strong, and what is known of it: the canonical names of the effects and those of none.

Each has a magnitude at three strengths. They were chosen so that, on the ``rich`` programme, what the base law cannot
absorb is about 1, 3 and 9 times the noise (NRMSE, ``refit.py``); what a case really has is in its truth.
"""

from dataclasses import dataclass

STRENGTHS = ("small", "visible", "strong")


@dataclass(frozen=True, slots=True)
class Effect:
    """One thing the bench can do.

    Attributes
    ----------
    bench
        ``coil``, ``damper`` or ``plain-damper``, see ``case.py``.
    unit
        SI unit of the magnitude.
    sizes
        Magnitudes at the three strengths.
    text
        What is done, and what the magnitude is.
    canonical
        The name that discovery may give it, empty if there is none.
    places
        For the others: words one of which the description of the place must hold.
    """

    bench: str
    unit: str
    sizes: tuple[float, float, float]
    text: str
    canonical: str = ""
    places: tuple[str, ...] = ()


_LIBRARY = {
    "eddy-current": ("coil", "ohm", (100.0, 30.0, 9.0), "loss resistance parallel to the inductance"),
    "resistance-error": ("coil", "1", (0.0009, 0.0026, 0.0077), "the map's resistance is too high by this share"),
    "resistance-heating": ("coil", "K/J", (0.00075, 0.0021, 0.0073), "copper warms by this per joule"),
    "probe-skew": ("coil", "s", (2e-4, 6e-4, 2e-3), "the current clamp is late"),
    "integrator-offset": ("coil", "V", (2.4e-4, 7e-4, 2.3e-3), "the electronic integrator drifts"),
    "saturation": ("coil", "Wb", (0.41, 0.23, 0.13), "the flux linkage saturates at this level"),
    "temperature": ("damper", "1/K", (0.0015, 0.0042, 0.014), "the damping force falls by this share per kelvin"),
    "current-lag": ("damper", "s", (0.0027, 0.0105, 0.05), "the fluid feels the current late, first order"),
    "delay": ("damper", "s", (0.00036, 0.00105, 0.0033), "the force is recorded late"),
    "residual-magnetism": ("damper", "A", (0.04, 0.11, 0.3), "half the width of the core's memory of current"),
    "current-saturation": ("damper", "A", (1.7, 1.2, 0.75), "the field saturates at this current"),
    "coulomb-friction": ("damper", "N", (36.0, 110.0, 350.0), "seals that slip, a Maxwell element"),
    "stribeck": ("damper", "N", (36.0, 100.0, 290.0), "friction that dies away above 30 mm/s"),
    "gas-spring": ("plain-damper", "N", (60.0, 180.0, 540.0), "polytropic gas at this force in mid-stroke"),
    "force-offset": ("damper", "N", (20.0, 60.0, 180.0), "the load cell's zero"),
    "inertia": ("damper", "kg", (3.9, 11.0, 32.0), "mass between damper and load cell"),
    "velocity-hysteresis": ("damper", "m/s", (0.0011, 0.0031, 0.010), "play in velocity"),
    "quadratic-drag": ("damper", "N*s^2/m^2", (4.8e3, 1.6e4, 5e4), "orifice loss, v |v|"),
    "asymmetry": ("damper", "1", (0.021, 0.06, 0.18), "rebound is stronger by this share, compression weaker"),
    "end-stop": ("damper", "N/m^1.5", (8.5e4, 2.4e5, 7e5), "rubber beyond 17 mm, power 1.5"),
}
_REALISED_OTHERWISE = {
    "velocity-hysteresis-by-stroke": Effect(
        "plain-damper", "1/s", (0.065, 0.2, 0.6), "velocity led by this times the stroke", "velocity-hysteresis"
    ),
    "delay-by-filter": Effect(
        "damper", "s", (0.00036, 0.00105, 0.0033), "the load cell's amplifier filters the force, first order", "delay"
    ),
    "stribeck-exponential": Effect(
        "damper", "N", (36.0, 100.0, 290.0), "friction that dies away as exp(-|v|/30 mm/s)", "stribeck"
    ),
}
_OUTSIDE = {
    "magnetic-aftereffect": Effect(
        "coil",
        "1",
        (0.02, 0.058, 0.2),
        "a share of the flux that creeps after the current, 0.12 s",
        places=("frequency 1 Hz", "-1Hz-", "reversal of the current"),
    ),
    "gap-vibration": Effect(
        "coil",
        "1",
        (0.011, 0.031, 0.10),
        "the air gap vibrates at 3.7 Hz",
        places=("high current", "amplitude 5", "amplitude 4.9", "-5A", "-4.9A"),
    ),
    "clamp-compression": Effect(
        "coil",
        "1",
        (0.0077, 0.022, 0.078),
        "the clamp reads this share too little of what exceeds +3.2 A",
        places=("high current", "amplitude 5", "amplitude 4.9", "-5A", "-4.9A"),
    ),
    "load-cell-resonance": Effect(
        "damper",
        "Hz",
        (250.0, 160.0, 86.0),
        "the load cell rings at this frequency",
        places=("current step", "near reversal", "6 Hz"),
    ),
    "cavitation": Effect(
        "damper",
        "1",
        (0.034, 0.095, 0.28),
        "rebound force collapses by this share beyond 90 mm/s",
        places=("rebound", "post-yield", "high speed", "2.8 A", "2.8A"),
    ),
    "backlash": Effect(
        "damper", "m", (1.7e-6, 6e-6, 3.5e-5), "half the play of the pin", places=("near reversal", "pre-yield")
    ),
}
EFFECTS: dict[str, Effect] = {
    **{name: Effect(*row, canonical=name) for name, row in _LIBRARY.items()},
    **_REALISED_OTHERWISE,
    **_OUTSIDE,
}


def size(name: str, strength: str) -> float:
    """Return the magnitude of an effect at a strength."""
    return EFFECTS[name].sizes[STRENGTHS.index(strength)]
