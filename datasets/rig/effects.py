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
        ``coil`` or ``damper``.
    unit
        SI unit of the magnitude.
    sizes
        Magnitudes at the three strengths.
    text
        What is done, and what the magnitude is.
    in_library
        Whether the effect has a canonical name that ``mrfit discover`` may give.
    places
        For the others: words one of which the description of the place must hold.
    """

    bench: str
    unit: str
    sizes: tuple[float, float, float]
    text: str
    in_library: bool = True
    places: tuple[str, ...] = ()


EFFECTS: dict[str, Effect] = {
    "eddy-current": Effect("coil", "ohm", (100.0, 30.0, 9.0), "loss resistance parallel to the inductance"),
    "resistance-error": Effect("coil", "1", (0.001, 0.003, 0.009), "the map's resistance is too high by this share"),
    "resistance-heating": Effect("coil", "K/J", (0.001, 0.003, 0.009), "copper warms by this per joule; 90 s cooling"),
    "probe-skew": Effect("coil", "s", (2e-4, 6e-4, 2e-3), "the current clamp is late"),
    "integrator-offset": Effect("coil", "V", (1e-4, 3e-4, 9e-4), "the electronic integrator drifts"),
    "saturation": Effect("coil", "Wb", (0.3, 0.2, 0.14), "the flux linkage saturates at this level"),
    "temperature": Effect("damper", "1/K", (0.0015, 0.0042, 0.014), "the damping force falls by this share per kelvin"),
    "current-lag": Effect("damper", "s", (0.0027, 0.0105, 0.05), "the fluid feels the current late, first order"),
    "delay": Effect("damper", "s", (0.00036, 0.00105, 0.0033), "the force is recorded late"),
    "residual-magnetism": Effect("damper", "A", (0.04, 0.11, 0.3), "half the width of the core's memory of current"),
    "current-saturation": Effect("damper", "A", (1.9, 1.35, 0.8), "the field saturates at this current"),
    "coulomb-friction": Effect("damper", "N", (36.0, 110.0, 350.0), "seals that slip, a Maxwell element"),
    "stribeck": Effect("damper", "N", (36.0, 100.0, 290.0), "friction that dies away above 30 mm/s"),
    "gas-spring": Effect("damper", "N", (50.0, 140.0, 450.0), "polytropic gas at this force in mid-stroke"),
    "force-offset": Effect("damper", "N", (20.0, 60.0, 180.0), "the load cell's zero"),
    "inertia": Effect("damper", "kg", (3.9, 11.0, 32.0), "mass between damper and load cell"),
    "velocity-hysteresis": Effect("damper", "m/s", (0.0011, 0.0031, 0.010), "play in velocity"),
    "quadratic-drag": Effect("damper", "N*s^2/m^2", (4.8e3, 1.6e4, 5e4), "orifice loss, v |v|"),
    "asymmetry": Effect("damper", "1", (0.021, 0.06, 0.18), "rebound is stronger by this share, compression weaker"),
    "end-stop": Effect("damper", "N/m^1.5", (8.5e4, 2.4e5, 7e5), "rubber beyond 17 mm, power 1.5"),
    "magnetic-aftereffect": Effect(
        "coil",
        "1",
        (0.02, 0.06, 0.18),
        "a share of the flux that creeps after the current, 0.12 s",
        False,
        ("1 Hz", "2 Hz", "slow", "reversal"),
    ),
    "gap-vibration": Effect(
        "coil", "1", (0.01, 0.03, 0.09), "the air gap vibrates at 3.7 Hz", False, ("5 A", "large", "amplitude", "peak")
    ),
    "clamp-compression": Effect(
        "coil",
        "1",
        (0.02, 0.06, 0.18),
        "the clamp reads this share too little of what exceeds +3.2 A",
        False,
        ("5 A", "positive", "high current", "peak", "amplitude", "large"),
    ),
    "load-cell-resonance": Effect(
        "damper", "Hz", (250.0, 160.0, 86.0), "the load cell rings at this frequency", False, ("step", "reversal")
    ),
    "cavitation": Effect(
        "damper",
        "1",
        (0.034, 0.095, 0.28),
        "rebound force collapses by this share beyond 90 mm/s",
        False,
        ("post-yield", "fast", "rebound", "extension", "speed"),
    ),
    "backlash": Effect(
        "damper", "m", (1.7e-6, 6e-6, 3.5e-5), "half the play of the pin", False, ("reversal", "pre-yield", "stroke")
    ),
}


def size(name: str, strength: str) -> float:
    """Return the magnitude of an effect at a strength."""
    return EFFECTS[name].sizes[STRENGTHS.index(strength)]
