"""The facts of a damper that the pages of ``mrfit apply`` begin with."""

from mrfit.apply.damper import Damper
from mrfit.report.numbers import significant


def facts_of(damper: Damper) -> list[tuple[str, str]]:
    """Return what a page says of its damper, as labels and words."""
    spec = damper.assembly.spec
    varying = ", ".join(f"{n} (order {o})" for n, o in damper.orders) or "the current is an input of the model"
    values = ", ".join(
        f"{n} {significant(v)} {p.unit}" for (n, v), p in zip(damper.parameters, spec.params, strict=True)
    )
    return [
        ("Damper", f"{damper.name}: {damper.model}"),
        ("Equation", spec.equation),
        ("Current", f"{damper.low:g} to {damper.high:g} A; depends on it: {varying}"),
        ("Parameters", values),
    ]
