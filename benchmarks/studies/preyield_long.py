"""Preyield paper at the currents between those that it tabulates: the same fits at 0.25, 0.5 and 0.75 A."""

from itertools import pairwise, product
from pathlib import Path

import numpy as np

from benchmarks.studies.page import Row, Study, Table, claim
from benchmarks.studies.preyield import FITS, HYSTERETIC, MODELS, SYMBOLS, own_table_values
from benchmarks.studies.runs import Place, fit_file, parameters, pipeline
from datasets.studies.preyield import CURRENTS


def at(current: float) -> str:
    """Return a current as names of fits have it."""
    return f"{current:g}A"


def over_current(place: Place, between: Path) -> dict[tuple[str, str, float], dict[str, float]]:
    """Return every fit's parameters in the table's units, by model, fit and current in A."""
    found = {}
    for model, fit, i in product(MODELS, FITS, CURRENTS):
        work = place.work if i in (0.0, 1.0) else between
        result = fit_file(work, f"{model}.{fit}.{at(i)}")["results"][0]
        found[model, fit, i] = own_table_values(model, parameters(result)) | {"cost": result["cost"]}
    return found


def current_table(found: dict[tuple[str, str, float], dict[str, float]]) -> Table:
    """Return the parameters at all five currents, of which the paper tabulates the first and the last."""
    rows = []
    for model, fit in product(MODELS, FITS):
        for key in SYMBOLS:
            values = [found[model, fit, i].get(key, np.nan) for i in CURRENTS]
            if np.isfinite(values).all():
                rows.append(Row(f"{model} {fit}, {SYMBOLS[key]}", [], list(values)))
    note = "The paper tabulates 0 and 1 A, see above; its tests at 0.25, 0.5 and 0.75 A are fitted here the same way."
    columns = [f"{i:g} A" for i in CURRENTS]
    return Table("Parameters at all five currents", "tests of section 3", "model, fit, parameter", columns, rows, note)


def current_words(found: dict[tuple[str, str, float], dict[str, float]]) -> Table:
    """Return whether what is concluded from 0 and 1 A holds between."""
    yielding = [
        (m, f) for m, f in product(MODELS, FITS) if np.isfinite(found[m, f, 0.0]["f_y_n"]) and m != "herschel-bulkley"
    ]
    steps = [found[m, f, b]["f_y_n"] > found[m, f, a]["f_y_n"] for m, f in yielding for a, b in pairwise(CURRENTS)]
    thin = [(m, f, i) for m, f, i in product(HYSTERETIC[:2], ("LMH",), CURRENTS)]
    shrinks = sum(found[m, "LMH", i]["v_h_mm_per_s"] < 0.5 * found[m, "MH", i]["v_h_mm_per_s"] for m, _, i in thin)
    best = {(f, i): min(MODELS, key=lambda m, f=f, i=i: found[m, f, i]["cost"]) for f, i in product(FITS, CURRENTS)}  # type: ignore[misc]
    other = [f"{m} {f} at {i:g} A" for (f, i), m in best.items() if m != "spencer"]
    rows = [
        claim("yield force", "rises with current", f"in {sum(steps)} of {len(steps)} steps", all(steps)),
        claim(
            "LMH fits",
            "hysteresis almost vanishes, at 0 and 1 A",
            f"v_h falls below half in {shrinks} of {len(thin)} fits at the five currents",
            shrinks == len(thin),
        ),
        claim(
            "Spencer",
            "fits best at 0 and 1 A",
            "; better: ".join([f"best in {len(best) - len(other)} of {len(best)} at the five currents", *other]),
            not other,
        ),
    ]
    return Table("The same between 0 and 1 A", "section 4, all currents", "of", [], rows)


def run(logs: Path, work: Path) -> Study:
    """Run the study."""
    place, between = Place(logs, work.with_name("preyield")), Place(logs, work)
    pipeline("preyield", place)
    pipeline("preyield-between", between)
    found = over_current(place, between.work)
    return Study(
        "preyield-long",
        "Nine models between 0 and 1 A",
        "Modelling MR dampers in preyield and postyield regions (Shock and Vibration)",
        "Logs of the study preyield; by `make studies-long`.",
        ["mrfit run pipelines/study-preyield-between.toml"],
        [current_words(found), current_table(found)],
    )
