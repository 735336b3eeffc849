"""Current and flux linkage of a log that holds field strength and flux density instead."""

from collections.abc import Sequence

from mrfit.core.channels import unit_of
from mrfit.core.recording import Finding
from mrfit.ingest import series
from mrfit.ingest.meaning.channel_map import CoilRule
from mrfit.ingest.meaning.naming import Signal

SAMPLE_COIL = CoilRule(turns=1.0, length=1e-3, area=1.0)
"""What stands for the coil where none is stated: amperes then are kA/m, and webers T, of sizes that models expect."""


def with_coil(signals: Sequence[Signal], coil: CoilRule | None) -> tuple[list[Signal], list[Finding]]:
    """Return the signals with current and flux linkage, and what was assumed for them.

    i = H·length/turns and λ = turns·area·B. Where the map states no coil, i is H in kA/m and λ is B in T. A log that
    holds a current or a flux linkage is left as it is.

    Parameters
    ----------
    signals
        The signals of a table.
    coil
        What the channel map says of the coil; None if nothing.
    """
    named = {s.name: s for s in signals}
    if not {"field_strength", "flux_density"} <= named.keys() or {"current", "flux"} & named.keys():
        return list(signals), []
    used = coil or SAMPLE_COIL
    factors = {
        "current": (named["field_strength"], used.length / used.turns),
        "flux": (named["flux_density"], used.turns * used.area),
    }
    made = [
        Signal(name, unit_of(name), series.mapped(lambda values, k=factor: k * values, source.values), source.index)
        for name, (source, factor) in factors.items()
    ]
    told = (
        "current stands for H and flux for B: read A as kA/m and Wb as T; "
        "for those of a coil write [coil] turns, length (m) and area (m²) in the channel map"
        if coil is None
        else f"current and flux linkage are those of H and B: {used.turns:g} turns, {used.length:g} m, {used.area:g} m²"
    )
    return [*signals, *made], [Finding("computed-channel", "flux", None, told)]
