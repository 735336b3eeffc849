"""Flux paper: SD, PSO-fmincon against fmincon, parameters, loops over current and frequency."""

import csv
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq

import mrfit
from benchmarks.command import run_mrfit
from benchmarks.studies.figures import Curve, Panel, draw
from benchmarks.studies.page import Row, Rule, Study, Table, claim, compare, within
from benchmarks.studies.runs import ROOT, Place, errors, fit_file, parameters, pipeline, published, value
from datasets.studies.coil_flux import Rig
from mrfit.models.boucwen_flux import derived

FIT, TWO = "boucwen-flux.pso-fmin", "two-exponents"
SEEDS = 5
# Nine of the ten cycles of a log
WHOLE_CYCLES = 2250
GAINS = Rule("one-sided: PSO-fmin ends lower by 0.1 % or more", lambda paper, own: (own[2] or 0.0) >= 0.1)
LEFT = Rule("share within 15 %", lambda paper, own: within(0.15).holds(paper[1:], own[1:]))
# Gain in % by a second exponent up to which one serves
ONE_SERVES = 5.0
# What the published fits began with, as their values say
STARTS = {"kappa": 3.5, "beta": 30.0, "gamma": 60.0, "D": 20.0}


def condition_of(place: Place) -> dict[tuple[int, int], str]:
    """Return the condition of every log by nominal frequency and current: off 1 Hz the current is less than nominal."""
    segments = pq.read_table(place.work / "segments.parquet").to_pydict()
    named = dict(zip(segments["recording"], segments["condition"], strict=True))
    return {(f, i): named[f"coil_{f:02d}Hz_{i}A"] for f in (1, 5, 10) for i in range(1, 6)}


def sd_table(place: Place) -> Table:
    """Return Table 1: standard deviation of the flux linkage by current and frequency."""

    def spread(f: int, i: int) -> float:
        frame = pq.read_table(place.work / "flux" / f"coil_{f:02d}Hz_{i}A.parquet").to_pydict()
        return float(np.std(frame["flux"][-WHOLE_CYCLES:]))

    rows = []
    for row in published("flux_standard_deviation"):
        i = int(row["current_a"])
        paper = [value(row[k]) for k in ("f1hz", "f5hz", "f10hz")]
        rows.append(compare(f"{i} A", paper, [spread(f, i) for f in (1, 5, 10)], within(0.25), "number"))
    columns = ["1 Hz", "5 Hz", "10 Hz"]
    note = f"Of the flux itself. The paper takes them for errors of its fits. {shares(fit_file(place.work, FIT))}"
    return Table("Standard deviation of the flux linkage, Wb", "Table 1", "current", columns, rows, note)


def shares(fit: dict[str, Any]) -> str:
    """Return how large the published and the own errors are against the flux's range."""
    slopes = {(r["frequency_hz"], r["current_a"]): float(r["A"]) * float(r["Lc_h"]) for r in parameter_rows()}
    printed = [
        100.0 * float(row[f"f{f}hz"]) / (2.0 * slopes[f, row["current_a"]] * float(row["current_a"]))
        for row in published("flux_standard_deviation")
        for f in ("1", "5", "10")
    ]
    own = [100.0 * e for c, e in errors(fit, "nrmse").items() if c != "all"]
    return (
        f"Published SDs are {min(printed):.2g} to {max(printed):.2g} % of the range of 2·A·Lc·I by the published "
        f"parameters; those of the model fitted here are {min(own):.2g} to {max(own):.2g} %."
    )


def parameter_rows() -> list[dict[str, str]]:
    """Return Tables 3-5."""
    return published("flux_boucwen_parameters")


def trends(place: Place) -> list[Row]:
    """Return what is said of Table 1, of the errors of the fits."""
    rmse, named = errors(fit_file(place.work, FIT), "rmse"), condition_of(place)
    found = np.array([[rmse[named[f, i]] for f in (1, 5, 10)] for i in range(1, 6)])
    rises, falls = np.diff(found, axis=0) > 0, np.diff(found, axis=1) < 0
    return [
        claim(
            "Table 1, over current",
            "error rises with current at every frequency",
            f"rises in {int(rises.sum())} of {rises.size} steps",
            bool(rises.all()),
        ),
        claim(
            "Table 1, over frequency",
            "error falls with frequency at every current",
            f"falls in {int(falls.sum())} of {falls.size} steps",
            bool(falls.all()),
        ),
    ]


def hybrid_table(place: Place, *more: str) -> Table:
    """Return Table 2: PSO-fmincon against fmincon at 1 Hz, medians and worst of five starts; with more options."""
    options = [*more, "--model", "boucwen-flux", "--per", "condition", "--only", "*-1Hz-*"]
    run_mrfit(place.work, "compare", "--optimizers", "fmin,pso-fmin", "--seeds", str(SEEDS), *options)
    with (place.work / "compare" / "optimizers.csv").open(encoding="utf-8") as file:
        cost = {(r["condition"], r["optimizer"]): float(r["median"]) for r in csv.DictReader(file)}
    named, rows = condition_of(place), []
    for row in published("flux_pso_fmincon_vs_fmincon_1hz"):
        i = int(row["current_a"])
        both, alone = (cost[named[1, i], o] for o in ("pso-fmin", "fmin"))
        gain = 100.0 * (alone - both) / alone
        printed = [float(row[k]) for k in ("pso_fmincon", "fmincon", "improvement_percent")]
        rows.append(compare(f"{i} A", printed, [both, alone, gain], GAINS, "ordering"))
    note = f"Medians over {SEEDS} starts, A free. At 3 A the printed errors give 0.49 %, not the 0.69 % printed."
    return Table(
        "PSO-fmin against fmin alone, Wb and %",
        "Table 2",
        "current at 1 Hz",
        ["PSO-fmincon", "fmincon", "improvement"],
        rows,
        note,
    )


def slope_table(place: Place) -> Table:
    """Return what Tables 3-5 determine of the parameters: the inductance A*Lc."""
    fit, named = fit_file(place.work, FIT), condition_of(place)
    found = {r["condition"]: parameters(r) for r in fit["results"]}
    rows, first = [], {}
    for row in published("flux_boucwen_parameters"):
        f, i = int(row["frequency_hz"]), int(row["current_a"])
        own = found[named[f, i]]["slope"]
        paper = float(row["A"]) * float(row["Lc_h"])
        first.setdefault(f, (paper, own))
        share = (paper / first[f][0], own / first[f][1])
        sides = [1e3 * paper, share[0]], [1e3 * own, share[1]]
        name = f"{f} Hz, {i} A"
        rows.append(compare(name, *sides, LEFT, "ordering") if i > 1 else Row(name, *sides))
    note = (
        "Of seven parameters the data determine A·Lc and the loop, not A, Lc, κ, β, γ and D one by one. Compared: the "
        "share of A·Lc left, against 1 A at the same frequency."
    )
    return Table(
        "Inductance A·Lc, mH, and its share of that at 1 A",
        "Tables 3-5",
        "test",
        ["A·Lc", "share"],
        rows,
        note,
    )


def planted_table(place: Place) -> Table:
    """Return the published parameters of 3 A and 1 Hz, found again in logs made from them."""
    work, logs = place.work / "planted", ROOT / "datasets" / "coil-planted" / "standard"
    run_mrfit(work, "ingest", str(logs))
    run_mrfit(work, "fit", "--model", "boucwen-flux", "--per", "all")
    found = parameters(fit_file(work, "boucwen-flux.auto.all")["results"][0])
    row = next(r for r in published("flux_boucwen_parameters") if (r["frequency_hz"], r["current_a"]) == ("1", "3"))
    p = {k: float(v) for k, v in row.items()}
    z_max = (p["kappa"] / (p["beta"] + p["gamma"])) ** (1.0 / p["n"])
    # D multiplies in the standard form, which these logs have
    truth = {
        "slope": ("A·Lc, mH", 1e3 * p["A"] * p["Lc_h"], 1e3, 0.005),
        "amplitude": ("(1 − A)·Lc·D·z_max, mWb", 1e3 * (1.0 - p["A"]) * p["Lc_h"] * p["D"] * z_max, 1e3, 0.05),
        "turnover": ("z_max/κ, mA", 1e3 * z_max / p["kappa"], 1e3, 0.15),
        "sharpness": ("n", p["n"], 1.0, 0.15),
        "rho": ("(β − γ)/(β + γ)", (p["beta"] - p["gamma"]) / (p["beta"] + p["gamma"]), 1.0, 0.3),
    }
    rows = [
        compare(word, [paper], [unit * found[k]], within(share), "recovered")
        for k, (word, paper, unit, share) in truth.items()
    ]
    note = "Logs made by the published model itself (`datasets/coil-planted/standard`)."
    return Table(
        "The published parameters at 3 A and 1 Hz, found again", "Table 3, 3 A", "combination", [""], rows, note
    )


def exponent_table(place: Place) -> Table:
    """Return what two exponents, as eq. 5 has them, bring beside the one of Tables 3-5."""
    one, two, named = fit_file(place.work, FIT), fit_file(place.work, TWO), condition_of(place)
    errs = [errors(fit, "rmse") for fit in (one, two)]
    exponents = [{r["condition"]: parameters(r) for r in fit["results"]} for fit in (one, two)]
    rows = []
    for f, i in named:
        c = named[f, i]
        single, pair = (e[c] for e in errs)
        found = [exponents[0][c]["n"], exponents[1][c]["n1"], exponents[1][c]["n2"]]
        rows.append(Row(f"{f} Hz, {i} A", [], [1e3 * single, 1e3 * pair, 100.0 * (single - pair) / single, *found]))
    single = [row.reproduced[3] or 0.0 for row in rows]
    ends = sum(n in (1.0, 10.0) for n in np.round(single, 2))
    note = (
        "mWb, %, 1. The paper prints eq. 5 with n1 and n2 and tabulates n1 = n2. Its start values for n are 1.3; what "
        f"the loops of this rig want is beside: n ends on a bound, 1 or 10, in {ends} of {len(rows)} fits."
    )
    columns = ["RMSE, n1 = n2", "RMSE, n1 ≠ n2", "gain", "n", "n1", "n2"]
    return Table("One exponent and two", "eq. 5", "test", columns, rows, note)


def exponent_words(table: Table) -> Row:
    """Return whether one exponent loses anything."""
    gains = {r.of: float(r.reproduced[2] or 0.0) for r in table.rows}
    better = [test for test, gain in gains.items() if gain > ONE_SERVES]
    return claim(
        "n1 = n2",
        "one exponent serves",
        f"two lower the error by more than {ONE_SERVES:g} % in {len(better)} of {len(gains)} tests, by "
        f"{max(gains.values()):.2g} % at most",
        not better,
    )


def moved_from_start(place: Place) -> Row:
    """Return how far the published kappa, beta, gamma and D are from round numbers, and how much data determine."""
    ranks = [r["conditioning"]["rank"] for r in fit_file(place.work, FIT)["results"]]
    rows = published("flux_boucwen_parameters")
    far = {k: [abs(float(r[k]) / s - 1.0) for r in rows] for k, s in STARTS.items()}
    close = sum(all(far[k][j] < 0.03 for k in STARTS) for j in range(len(rows)))
    return claim(
        "κ, β, γ, D",
        f"within 3 % of 3.5, 30, 60 and 20 in {close} of {len(rows)} fits",
        f"the data determine {min(ranks)} to {max(ranks)} of 7 parameters, so start values stay",
        close >= 13 and max(ranks) < 7,
    )


def readings() -> str:
    """Return the loop's height by the published parameters, with D dividing as printed and with D multiplying."""
    rows = published("flux_boucwen_parameters")
    names = ("A", "Lc_h", "kappa", "beta", "gamma", "n", "D")
    theta = np.array([[float(r[k]) for k in names] for r in rows])
    other = theta.copy()
    other[:, 6] = 1.0 / other[:, 6]
    current = np.array([float(r["current_a"]) for r in rows])
    shares = [100.0 * np.abs(d[:, 1]) / (d[:, 0] * current) for d in (derived(theta), derived(other))]
    printed, standard = (f"{s.min():.2g} to {s.max():.2g} %" for s in shares)
    return (
        f"With the printed D⁻¹ the published parameters give a loop as high as {printed} of the flux; multiplied by D "
        f"it is {standard}, which is what the figures show. The planted logs have the latter."
    )


def losses(place: Place) -> list[Row]:
    """Return what is said of the loops: their area over current and width over frequency."""
    flux = json.loads((place.work / "flux.json").read_text(encoding="utf-8"))
    area = {r["id"]: r["loop_area"] for r in flux["recordings"]}
    grid = np.array([[area[f"coil_{f:02d}Hz_{i}A"] for i in range(1, 6)] for f in (1, 5, 10)])
    wide = width(place)
    return [
        claim(
            "Fig. 8, loops over current",
            "area grows with current",
            "at 1 Hz " + " < ".join(f"{1e3 * a:.1f}" for a in grid[0]) + " mJ",
            bool((np.diff(grid, axis=1) > 0).all()),
        ),
        claim(
            "Fig. 9, loops over frequency",
            "width grows with frequency",
            f"at 3 A width at zero flux {', '.join(f'{1e3 * w:.0f}' for w in wide)} mA at 1, 5, 10 Hz",
            bool(np.all(np.diff(wide) > 0)),
        ),
    ]


def loop(place: Place, log: str) -> tuple[Any, Any, Any]:
    """Return current, flux and voltage of the last whole cycle of a log."""
    frame = mrfit.read(str(place.logs / f"{log}.csv"))[0].to_frame()
    flux = pq.read_table(place.work / "flux" / f"{log}.parquet").to_pandas()
    last = slice(-251, None)
    return (
        frame["current"].to_numpy()[last],
        flux["flux"].to_numpy()[last],
        frame["voltage"].to_numpy()[last],
    )


def width(place: Place) -> list[float]:
    """Return the loop's width in A at zero flux, at 3 A and 1, 5, 10 Hz."""
    found = []
    for f in (1, 5, 10):
        current, flux, _ = loop(place, f"coil_{f:02d}Hz_3A")
        flux = flux - 0.5 * (flux.max() + flux.min())
        cross = np.flatnonzero(np.diff(np.sign(flux)))
        at = [current[k] - flux[k] * (current[k + 1] - current[k]) / (flux[k + 1] - flux[k]) for k in cross]
        rising = [a for k, a in zip(cross, at, strict=True) if flux[k + 1] > flux[k]]
        falling = [a for k, a in zip(cross, at, strict=True) if flux[k + 1] <= flux[k]]
        found.append(float(np.mean(rising) - np.mean(falling)))
    return found


def figures(place: Place) -> list[tuple[str, str]]:
    """Write loops over current, over frequency, and the voltage."""
    axes = ("current, A", "flux linkage, Wb")
    over_current = {f"{i} A": loop(place, f"coil_01Hz_{i}A") for i in (5, 3, 1)}
    over_frequency = {f"{f} Hz": loop(place, f"coil_{f:02d}Hz_3A") for f in (1, 5, 10)}
    voltage = {f"{f} Hz": loop(place, f"coil_{f:02d}Hz_1A")[2] for f in (1, 5, 10)}
    cycle = np.linspace(0.0, 1.0, 251)
    panels = [
        Panel("1 Hz", axes, [Curve(i, y, word, k) for k, (word, (i, y, _)) in enumerate(over_current.items())]),
        Panel(
            "3 A nominal",
            axes,
            [Curve(i, y, word, k) for k, (word, (i, y, _)) in enumerate(over_frequency.items())],
        ),
        Panel(
            "1 A nominal",
            ("cycle", "voltage, V"),
            [Curve(cycle, u, word, k) for k, (word, u) in enumerate(voltage.items())],
        ),
    ]
    draw("coil-flux.svg", panels)
    return [("coil-flux.svg", "Loops over current (Fig. 8), over frequency (Fig. 9) and the coil's voltage (Fig. 4)")]


def core(place: Place) -> list[Table]:
    """Return the tables of a rig."""
    pipeline("coil-flux", place)
    one, exponents = sd_table(place), exponent_table(place)
    words = [*trends(place), moved_from_start(place), exponent_words(exponents), *losses(place)]
    return [Table("What the paper says", "sections 3-5", "of", [], words), one, slope_table(place), exponents]


RIGS = {f"iron, resistance and eddy loss of draw {k}": Rig().drawn(k) for k in (1, 2)}
CHECKS = {
    "no eddy currents": replace(Rig(), eddy=math.inf),
    "three times the eddy currents: 20 Ω": replace(Rig(), eddy=20.0),
    "the voltage set again at every frequency": replace(Rig(), corrected=True),
    "both searches end after 400 evaluations": lambda place: [hybrid_table(place, "--budget", "400")],
    "both searches end after 100 evaluations": lambda place: [hybrid_table(place, "--budget", "100")],
}


def run(logs: Path, work: Path) -> Study:
    """Run the study."""
    place = Place(logs, work)
    return Study(
        "coil-flux",
        "Bouc-Wen flux model of a coil",
        "Tang, Bankosz, Goldasz, flux model of a dual-coil actuator",
        "Rig: a voltage-driven coil of sinh iron with stop operators and 60 Ω of eddy loss; 1, 5, 10 Hz by 1 to 5 A, "
        "the voltage set at 1 Hz and, as in the paper, not corrected at 5 and 10 Hz.",
        [
            "mrfit run pipelines/study-coil-flux.toml",
            "mrfit compare --optimizers fmin,pso-fmin --model boucwen-flux --per condition --only '*-1Hz-*' "
            f"--seeds {SEEDS}",
        ],
        [*core(place), hybrid_table(place), planted_table(place)],
        [
            "The fall of Table 1's errors with frequency needs no better model at 10 Hz: the voltage was not "
            "corrected, the current fell, and a smaller current saturates the iron less.",
            "Table 1 agrees with the standard deviation of the flux itself: it looks like the size of the signal, not "
            "the error of a fit. What the paper reads in it, errors that rise with current and fall with frequency, "
            "the signal does as well.",
            "A·Lc of Tables 3-5 rises with frequency by 41 % at 1 A and by 1 % at 5 A. More eddy currents, none, and a "
            "corrected voltage (checks 1 to 3) leave the shares apart: no rate-independent coil gives both.",
            readings(),
        ],
        ["Table 6: its numbers are lost in the scan."],
        figures(place),
    )
