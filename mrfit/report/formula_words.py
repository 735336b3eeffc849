"""Sentences of a formula for what no law makes and no effect of the library describes."""

from mrfit.io.schemas.discovery import DiscoveryFile
from mrfit.report.determined import measured
from mrfit.report.numbers import percent

# Readings that are listed
MOST_ALIKE = 3


def formula_sentences(found: DiscoveryFile) -> list[str]:
    """Return sentences on a formula that was looked for; none where none was."""
    own = found.proposed
    if own is None:
        return []
    if not own.text:
        return [f"No formula is proposed: {own.reason}."]
    said = [f"A formula is proposed, which is no proof: F = F_base {_signed(own.text)}."]
    said += [f"Of it {c.name.partition(': ')[2]} has the coefficient {measured(c)}." for c in own.coefficients]
    if own.closed is not None:
        said.append(
            f"On held-out conditions it takes {100.0 * own.closed:.0f} % of what no law makes there: "
            f"from {percent(own.law)} to {percent(own.after)} of the range."
        )
    if own.alike:
        said.append(f"These data do not tell it from {'; '.join(own.alike[:MOST_ALIKE])}.")
    box = ", ".join(f"{r.symbol} ({r.channel}) from {r.low:.3g} to {r.high:.3g} {r.unit}" for r in own.box)
    said.append(f"Known is what no law makes of it, {100.0 * own.left:.0f} % of its force, within {box}.")
    said.append(f"Fit it jointly with --plugin and discover/{own.file}; outside these ranges it is held at their edge.")
    return said


def _signed(text: str) -> str:
    return text if text.startswith("-") else f"+{text}"
