"""Sentences of the terms that a base's law lacks."""

from mrfit.io.schemas.discovery import DiscoveryFile
from mrfit.report.determined import measured
from mrfit.report.numbers import percent


def law_repair_sentences(found: DiscoveryFile) -> list[str]:
    """Return sentences on a repair of the law that was looked for; none where none was."""
    own = found.lacking
    if own is None:
        return []
    if own.reason:
        return [f"No term that the law of {found.base_model} may lack helps: {own.reason}."]
    said = f"The law of {found.base_model} lacks {' and '.join(own.titles)}"
    if own.before is not None:
        said += f": with it the plain error on held-out conditions falls from {percent(own.before)} to "
        said += f"{percent(own.after)}, the base fitted again in both"
    lines = [f"{said}."]
    lines += [f"Of it {c.name.partition(': ')[2]} has the strength {measured(c)}." for c in own.coefficients]
    lines.append(
        f"It takes {100.0 * own.takes:.0f} % of the squared error on conditions left out, terms shifted in time "
        f"{100.0 * own.chance:.0f} % at most."
    )
    if own.alike:
        lines.append(f"These data do not tell it from {', '.join(own.alike)}.")
    if own.other_law:
        lines.append(f"Of other bases {own.other_law} leaves least there: {percent(own.other_error)}.")
    return lines
