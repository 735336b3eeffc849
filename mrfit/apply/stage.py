"""What the commands of ``mrfit apply`` leave in a workspace: ``apply/``, a page and the numbers behind it."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mrfit.apply.figures import MEASURED, PALETTE, SIMULATED, Curve, Panel, figure
from mrfit.apply.inverse import FLAGS, REACHED
from mrfit.apply.motion import Motion
from mrfit.apply.page import Drawn, Section, Table, facts_of, render
from mrfit.apply.series import Inversion
from mrfit.io.workspace import Workspace, write_json, write_table, write_text

SCHEMA = "mrfit/apply-{}/1"


def write(work: Path, name: str, content: dict[str, Any], page: str) -> dict[str, Any]:
    """Write a page and its JSON file; return the content with where they are."""
    folder = Workspace(work).root / "apply"
    content = {"schema": SCHEMA.format(name), **content}
    write_json(folder / f"{name}.json", content)
    write_text(folder / f"{name}.html", page)
    return {**content, "page": str(folder / f"{name}.html"), "file": str(folder / f"{name}.json")}


def invert(work: Path, found: Sequence[tuple[Motion, Inversion]]) -> dict[str, Any]:
    """Write the currents of desired forces as Parquet tables, and the page; return the summary."""
    rows = [{"motion": motion.name, **one.summary} for motion, one in found]
    first = found[0][1]
    notes = notes_of(first)
    content = {"fit": first.damper.name, "motions": rows, "notes": notes}
    sections = [_inversion_section(motion, one, k) for k, (motion, one) in enumerate(found)]
    sections.insert(0, Section("Summary", notes, [_shares(found)]))
    lead = "The current for a desired force, sample by sample, with the state of damper and coil carried along."
    page = render(f"Inverse of {first.damper.name}", lead, facts_of(first.damper), sections, "invert.json")
    for k, (_, one) in enumerate(found, start=1):
        columns = {n: np.asarray(c, dtype=np.float64) for n, c in one.to_frame().items()}
        write_table(Workspace(work).root / "apply" / f"invert-{k}.parquet", columns)
    return write(work, "invert", content, page)


def notes_of(one: Inversion) -> list[str]:
    """Return what is to be said of how currents were found."""
    notes = [
        "Currents were found in closed form: the force is a polynomial of current."
        if one.explicit
        else "Currents were found by Newton's method, safeguarded by bisection; of several that give a force, the least."
    ]
    if one.dead_time > 0.0:
        notes.append(f"Commands are sent {1e3 * one.dead_time:.3g} ms early, since the field answers that much later.")
    if one.behind:
        notes.append(f"Not inverted, its lag stays as error: {', '.join(one.behind)}.")
    return notes


def _shares(found: Sequence[tuple[Motion, Inversion]]) -> Table:
    unit = "N" if found[0][1].damper.output == "force" else "N·m"
    heads = ("motion", "samples", *(f"{n} (%)" for n in FLAGS.values()), "limited (%)", f"greatest error where reached ({unit})", f"rms error ({unit})")  # fmt: skip
    rows = []
    for motion, one in found:
        s = one.summary
        shares = [100.0 * float(s["shares"][n]) for n in FLAGS.values()]
        rows.append((motion.name, s["samples"], *shares, 100.0 * s["limited"], s["greatest_error_where_reached"], s["rms_error"]))  # fmt: skip
    return Table("Desired forces: reached, saturated, or held back by coil and amplifier", heads, rows)


def _inversion_section(motion: Motion, one: Inversion, k: int) -> Section:
    unit = "N" if one.damper.output == "force" else "N·m"
    t, out = one.time, one.flag != REACHED
    panels = [
        Panel("Force", "t (s)", f"F ({unit})", [
            Curve(t, one.desired, "desired", MEASURED, "-", 2.0), Curve(t, one.force, "given", SIMULATED)],
            (t, one.low, one.high, "any current gives"), spans(t, out)),
        Panel("Current", "t (s)", "i (A)", [
            Curve(t, one.current, "command", PALETTE[2]), Curve(t, one.field, "seen by the fluid", PALETTE[0], "--")]),
    ]  # fmt: skip
    caption = "Grey: forces that some current gives at this motion. Red: the desired force is outside."
    drawn = Drawn("Force and current.", caption, figure(panels, f"i{k}", f"Force and current, {motion.name}"))
    return Section(motion.name, (), (), (drawn,))


def spans(t: np.ndarray[Any, Any], where: np.ndarray[Any, Any], most: int = 200) -> list[tuple[float, float]]:
    """Return the stretches of time in which something holds, the first ``most`` of them."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], where, [False]]).astype(int)))
    step = float(t[1] - t[0]) if len(t) > 1 else 0.0
    return [(float(t[a]) - step / 2, float(t[b - 1]) + step / 2) for a, b in zip(edges[::2], edges[1::2], strict=True)][
        :most
    ]
