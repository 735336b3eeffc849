"""Damper and amplifier as the documents of ``mrfit apply`` have them."""

from mrfit.apply.damper import Damper
from mrfit.apply.inverse import Amplifier
from mrfit.io.schemas.apply import AmplifierEntry, DamperEntry


def damper_entry(damper: Damper) -> DamperEntry:
    """Return a damper as a part of a document."""
    return DamperEntry(
        name=damper.name,
        model=damper.model,
        parameters=damper.parameters,
        orders=damper.orders,
        low=damper.low,
        high=damper.high,
    )


def amplifier_entry(amplifier: Amplifier) -> AmplifierEntry:
    """Return an amplifier as a part of a document."""
    return AmplifierEntry(
        most=amplifier.most,
        least=amplifier.least,
        rate=amplifier.rate,
        voltage=amplifier.voltage,
        resistance=amplifier.resistance,
        inductance=amplifier.inductance,
    )
