"""Preyield paper: nine models by LMH and MH fits, their errors by velocity class, and the skyhook ride over a bump."""

import json
from dataclasses import replace
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np

import mrfit
from benchmarks.apply_papers import RIDE_PARAMETERS, ride_damper
from benchmarks.command import run_anywhere
from benchmarks.studies.figures import Curve, Panel, draw
from benchmarks.studies.page import Row, Rule, Study, Table, claim, compare, within
from benchmarks.studies.runs import Place, errors, fit_file, parameters, pipeline, published, value
from datasets.studies.preyield import AMPLITUDES, SLOW, SLOW_FREQUENCY, Rig
from mrfit.apply.car import Car, Control, Timing, drive, rms
from mrfit.apply.damper import Damper, damper
from mrfit.apply.roads import Bump
from mrfit.apply.stepper import Stepper

MODELS = (
    "bingham",
    "herschel-bulkley",
    "biviscous",
    "regularised-bingham",
    "hysteretic-biviscous",
    "hysteretic-regularised-bingham",
    "guo",
    "polynomial",
    "spencer",
)
HYSTERETIC = MODELS[4:7]
FITS = ("LMH", "MH")
# The six tests that the paper's figures 7 to 15 show
TESTS = {"L": "04mm_0.5Hz", "M": "04mm_4Hz", "H": "16mm_2Hz"}
CLASSES = {"L": "L", "MH": "MH", "all": "LMH", "postyield": "MH", "preyield": "L"}
STEP = 4e-4
SHARE = 0.25
BELOW_1_N = Rule("a printed 0: below 1 N", lambda paper, own: (own[0] or 0.0) < 1.0)
UPPER_END = Rule("upper end within 50 %", lambda paper, own: within(0.5).holds(paper[1:], own[1:]))
BOTH = within(0.1, ", LMH and MH")
SYMBOLS = {
    "c_0": "C0",
    "v_y_mm_per_s": "v_y, mm/s",
    "v_h_mm_per_s": "v_h, mm/s",
    "c_inf_ns_per_m": "C∞, N·s/m",
    "f_y_n": "f_y, N",
}
MISPRINTED = {("biviscous", "MH", "v_y_mm_per_s"): 10.0}


def own_table_values(model: str, found: dict[str, float]) -> dict[str, float]:
    """Return a fit's parameters as Tables 1-2 have them, in N, N*s/m (s/m for guo's C0) and mm/s."""
    fy, c = found.get("fy", np.nan), found["C_inf"] if "C_inf" in found else np.nan
    rows = {"f_y_n": fy, "c_inf_ns_per_m": c}
    if model == "biviscous":
        # the tables obey C0*vy = fy + C_inf*vy
        rows |= {"c_0": fy / found["vy"] + c, "v_y_mm_per_s": 1e3 * found["vy"]}
    elif model == "hysteretic-biviscous":
        c0, vh = found["C0"], found["vh"]
        rows |= {"c_0": c0, "v_y_mm_per_s": 1e3 * (fy - c0 * vh) / (c0 - c), "v_h_mm_per_s": 1e3 * vh}
    else:
        rows |= {"c_0": found.get("C0", np.nan), "v_y_mm_per_s": 1e3 * found.get("vy", np.nan)}
        rows |= {"v_h_mm_per_s": 1e3 * found.get("vh", np.nan)}
    return rows


def parameter_table(place: Place, current: int) -> Table:
    """Return Table 1 (0 A) or Table 2 (1 A), a row a parameter."""
    rows = []
    for row in published("preyield_parameters"):
        if int(row["current_a"]) != current:
            continue
        model, fit = row["model"], row["fit"]
        own = own_table_values(model, parameters(fit_file(place.work, f"{model}.{fit}.{current}A")["results"][0]))
        for key in SYMBOLS:
            printed = value(row[key])
            if printed is None:
                continue
            printed *= MISPRINTED.get((model, fit, key), 1.0)
            rule, name = within(SHARE) if printed else BELOW_1_N, f"{model} {fit}, {SYMBOLS[key]}"
            rows.append(compare(name, [printed], [own[key]], rule, "recovered"))
    note = "C0 in N·s/m, of guo in s/m. biviscous MH prints v_y 1.8 and 4.1 for 18 and 41."
    return Table(f"Parameters at {current} A", f"Table {current + 1}", "model, fit, parameter", [""], rows, note)


@cache
def nrmse(place: Place) -> dict[tuple[str, str, str, int], float]:
    """Return the error in % of every model and fit on the six tests, fitted or not."""
    logs = {
        (band, i): mrfit.read(str(place.logs / f"sine_{test}_{i}A.csv"))
        for (band, test), i in product(TESTS.items(), (0, 1))
    }
    found = {}
    for model, fit, i in product(MODELS, FITS, (0, 1)):
        loaded = mrfit.load(place.work / "fits" / f"{model}.{fit}.{i}A" / "fit.json")
        for band in TESTS:
            found[model, fit, band, i] = 100.0 * mrfit.predict(loaded, logs[band, i]).nrmse
    return found


def error_table(place: Place) -> Table:
    """Return the errors of all models on the six tests."""
    found = nrmse(place)
    rows = [
        Row(f"{m} {f}", [], [found[m, f, band, i] for band in TESTS for i in (0, 1)]) for m, f in product(MODELS, FITS)
    ]
    columns = [f"{band} {i} A" for band in TESTS for i in (0, 1)]
    note = "Low, medium and high test at 0 and 1 A, as the figures show. The paper prints ranges only, see above."
    return Table("NRMSE on the six tests, %", "Figs 7-15", "model, fit", columns, rows, note)


def range_table(place: Place) -> Table:
    """Return the errors of section 4's text beside the same of the study."""
    found, rows = nrmse(place), []
    for row in published("preyield_nrmse_ranges"):
        fits = FITS if row["fit"] == "any" else (row["fit"],)
        bands = CLASSES[row["region"]]
        own = [found[row["model"], f, b, i] for f in fits for b in bands for i in (0, 1)]
        low, high = value(row["nrmse_low_percent"]), value(row["nrmse_high_percent"])
        name = f"{row['model']} {row['fit']}, {row['region']}"
        rows.append(compare(name, [low, high], [min(own), max(own)], UPPER_END, "number"))
    note = "postyield: medium and high test; preyield: low test."
    return Table("NRMSE ranges, %", "section 4", "model, fit, region", ["from", "to"], rows, note)


def orderings(place: Place) -> Table:
    """Return section 4's statements as orderings."""
    found = nrmse(place)

    def mean(model: str, fit: str, bands: str) -> float:
        return float(np.mean([found[model, fit, b, i] for b in bands for i in (0, 1)]))

    low = sum(mean(m, "LMH", "L") < mean(m, "MH", "L") for m in MODELS)
    high = sum(mean(m, "MH", "H") < mean(m, "LMH", "H") for m in HYSTERETIC)
    tests = list(product(FITS, TESTS, (0, 1)))
    winner = {t: min(MODELS, key=lambda m, t=t: found[m, *t]) for t in tests}  # type: ignore[misc]
    better = [f"{m} {f} in {b} at {i} A" for (f, b, i), m in winner.items() if m != "spencer"]
    plain = sum(mean(m, "MH", "H") < mean("bingham", "MH", "H") for m in HYSTERETIC)
    vh = {
        (m, f, i): own_table_values(m, parameters(fit_file(place.work, f"{m}.{f}.{i}A")["results"][0]))["v_h_mm_per_s"]
        for m, f, i in product(HYSTERETIC[:2], FITS, (0, 1))
    }
    shrinks = sum(vh[m, "LMH", i] < 0.5 * vh[m, "MH", i] for m, i in product(HYSTERETIC[:2], (0, 1)))
    of_order = {n: errors(fit_file(place.work, name), "nrmse")["all"] for n, name in POLYNOMIALS.items()}
    shown = ", ".join(f"order {n} {100.0 * e:.3g} %" for n, e in of_order.items())
    bulk = parameters(fit_file(place.work, "herschel-bulkley.LMH.1A")["results"][0])["fy"]
    rows = [
        claim("low velocity", "LMH fits predict it better than MH fits", f"{low} of 9 models", low == 9),
        claim("high velocity, hysteretic", "MH fits predict it better than LMH fits", f"{high} of 3 models", high == 3),
        claim(
            "Spencer",
            "best in every range and fit",
            "; better: ".join([f"best in {12 - len(better)} of 12", *better]),
            not better,
        ),
        claim("hysteresis", "hysteretic models beat Bingham at high velocity", f"{plain} of 3 models", plain == 3),
        claim("LMH fits", "hysteresis almost vanishes", f"v_h falls below half in {shrinks} of 4 fits", shrinks == 4),
        claim(
            "order of the polynomial, LMH at 1 A",
            "6 at least, 12 recommended",
            f"NRMSE by {shown}",
            of_order[12] < of_order[6] < of_order[3],
            rule="12 below 6 below 3",
        ),
        claim("Herschel-Bulkley, 1 A", "f_y goes to 0", f"f_y = {bulk:.2g} N", bulk < 1.0, "recovered"),
    ]
    return Table("What section 4 concludes", "section 4", "of", [], rows)


# Fits of the polynomial by order
POLYNOMIALS = {3: "polynomial-3.LMH.1A", 6: "polynomial-6.LMH.1A", 12: "polynomial.LMH.1A"}
Dampers = dict[tuple[str, str], Damper]


def own_damper(place: Place, model: str, fit: str) -> Damper:
    """Return a damper of a model's fits at 0 and 1 A, linear in current between."""
    ends = [parameters(fit_file(place.work, f"{model}.{fit}.{i}A")["results"][0]) for i in (0, 1)]
    names = [q["name"] for q in fit_file(place.work, f"{model}.{fit}.0A")["results"][0]["parameters"]]
    # the preload carries what the gas chamber gives at rest; a polynomial has it in its two constants
    rest = parameters(fit_file(place.work, f"bingham.{fit}.0A")["results"][0])["f0"]
    for end in ends:
        end.update({n: end[n] - rest for n in ("f0", "a0", "b0") if n in end})
    ends[1] |= {"f0": ends[0]["f0"]} if "f0" in ends[0] else {}
    fixed = {n: ends[0][n] for n in names if ends[0][n] == ends[1][n]}
    moving = {f"{n}@{i}A": ends[i][n] for n in names if n not in fixed for i in (0, 1)}
    return damper(model, {**moving, **fixed}, {n: 1 for n in names if n not in fixed})


def own_dampers(place: Place) -> Dampers:
    """Return the dampers of all models and fits of the study."""
    return {(m, f): own_damper(place, m, f) for m, f in product(MODELS, FITS)}


def ride_table(dampers: Dampers, step: float = STEP) -> Table:
    """Return Tables 3-4: rms of the sprung acceleration under on-off skyhook."""
    car, timing = Car(500.0, 0.0, 78e3), Timing(step, 1)
    rides = {
        key: rms(drive(Stepper(d), car, [(Control("skyhook-on-off"), Bump())], timing)[0].acceleration)
        for key, d in dampers.items()
    }
    rows = []
    for row in published("skyhook_rms_acceleration"):
        model, printed = row["model"], [float(row[fit]) for fit in FITS]
        own = [rides[model, fit] for fit in FITS if (model, fit) in rides]
        # bingham's force has no value at rest: its ride is that of the step
        if own:
            rows.append(
                compare(model, printed, own, BOTH, "number") if model != "bingham" else Row(model, printed, own)
            )
    note = (
        "m/s², M = 500 kg, K = 78 kN/m, bump of 20 mm by 1 m at 15 km/h, dampers of the study's own fits. The ride of "
        f"bingham is that of the step, here {1e3 * step:g} ms, and is not compared; "
        "[apply_papers](benchmarks/apply_papers.md) has the rides by the published parameters."
    )
    return Table("Rms of the sprung acceleration, m/s²", "Tables 3-4", "model", list(FITS), rows, note)


def ride_words(rides: Table) -> Table:
    """Return what section 5 concludes from Tables 3-4."""
    rows = {r.of: (r.published, r.reproduced) for r in rides.rows}
    calm = ("herschel-bulkley", "biviscous", "regularised-bingham", "guo")

    def counted(side: int) -> tuple[int, int, int]:
        worst = sum(rows["spencer"][side][k] > rows[m][side][k] for m in calm for k in (0, 1))  # type: ignore[operator]
        slower = sum(rows[m][side][1] > rows[m][side][0] for m in calm)  # type: ignore[operator]
        bingham = sum(rows["bingham"][side][k] > 1.5 * rows[m][side][k] for m in calm for k in (0, 1))  # type: ignore[operator]
        return worst, slower, bingham

    paper, own = counted(0), counted(1)
    words = (
        ("Spencer dissipates less than the models without chatter", 8, "greater rms in {} of 8"),
        ("MH fits attenuate slower than LMH fits", 4, "greater rms in {} of 4"),
        ("Bingham chatters", 8, "more than 1.5 times the rms of a calm model in {} of 8"),
    )
    return Table(
        "What section 5 concludes",
        "section 5",
        "of",
        [],
        [
            claim(of, text.format(p), text.format(o), o == p == whole)
            for (of, whole, text), p, o in zip(words, paper, own, strict=True)
        ],
    )


def slow_table(place: Place) -> Table:
    """Return the quasi-static test, which prints no number: stiffness, force and friction, beside those of the rig."""
    rig = Rig()
    [found] = json.loads(run_anywhere("measure", "quasi-static", str(place.logs / SLOW), "--json"))
    # what the leak lets through at the mean speed of the part of the stroke that is looked at
    speed = 2.0 * np.pi * SLOW_FREQUENCY * AMPLITUDES[-1] * np.sqrt(1.0 - np.linspace(-0.6, 0.6, 41) ** 2).mean()
    rows = [
        Row("stiffness of the gas chamber, N/m", [], [rig.stiffness, found["stiffness"]]),
        Row("force at mid-stroke, N", [], [rig.offset, found["offset"]]),
        Row("friction, N", [], [rig.pre_yield[0] * speed, found["friction"]]),
    ]
    note = "Fig. 2 prints no number. The friction of the rig is that of its leak."
    return Table("Quasi-static test", "Fig. 2", "of", ["rig", "measured"], rows, note)


def figures(place: Place) -> list[tuple[str, str]]:
    """Write measured and simulated loops of the low and the high test at 1 A over each other."""
    panels = []
    for band, test in (("L", "04mm_0.5Hz"), ("H", "16mm_2Hz")):
        log = mrfit.read(str(place.logs / f"sine_{test}_1A.csv"))
        curves = []
        for k, (model, fit) in enumerate((("bingham", "MH"), ("guo", "MH"), ("guo", "LMH"), ("spencer", "MH"))):
            frame = mrfit.predict(mrfit.load(place.work / "fits" / f"{model}.{fit}.1A" / "fit.json"), log).to_frame()
            last = frame.iloc[-401:]
            x, y = 1e3 * last["velocity"].to_numpy(), last["simulated"].to_numpy()
            if not curves:
                curves.append(Curve(x, last["measured"].to_numpy(), "measured", 5, "", "."))
            curves.append(Curve(x, y, f"{model} {fit}", k))
        panels.append(Panel(f"{band}: {test.replace('_', ', ')}, 1 A", ("velocity, mm/s", "force, N"), curves))
    draw("preyield.svg", panels)
    return [("preyield.svg", "A low and a high test at 1 A, measured and predicted (Figs 7, 13, 15)")]


def core(place: Place) -> list[Table]:
    """Return the tables of a rig: its fits at 0 and 1 A, their errors, and the ride."""
    pipeline("preyield", place)
    rides = ride_table(own_dampers(place))
    return [
        parameter_table(place, 0),
        parameter_table(place, 1),
        range_table(place),
        orderings(place),
        rides,
        ride_words(rides),
    ]


def printed_rides(place: Place) -> list[Table]:
    """Return the ride by the published parameters of six models, of biviscous by eq. 3 as it is printed."""
    printed = "biviscous-printed"
    own = {"biviscous" if m == printed else m: m for m in RIDE_PARAMETERS if m != "biviscous"}
    return [ride_table({(m, f): ride_damper(own[m], f) for m, f in product(own, FITS)})]


def finer_rides(place: Place) -> list[Table]:
    """Return the ride of the study's own fits at a quarter of the step."""
    rides = ride_table(own_dampers(place), STEP / 4)
    return [rides, ride_words(rides)]


# What the paper prints is at 0 and 1 A; a quick rig has half the samples
QUICK = Rig(currents=(0.0, 1.0), per_cycle=200)
RIGS = {f"gas spring, noise and number of chains of draw {k}": QUICK.drawn(k) for k in (1, 2)}
CHECKS = {
    "the plug's viscosity does not thin with speed": replace(QUICK, thinning=(1e3, 1e3)),
    "rides by the published parameters, of biviscous by eq. 3 as printed, not by the study's fits": printed_rides,
    "rides at a step of 0.1 ms, not 0.4 ms": finer_rides,
}


def run(logs: Path, work: Path) -> Study:
    """Run the study."""
    place = Place(logs, work)
    return Study(
        "preyield",
        "Nine models before and beyond the yield point",
        "Modelling MR dampers in preyield and postyield regions (Shock and Vibration)",
        "Rig: stop operators in series with a leak, a shear-thinning plug and a gas spring "
        "(`datasets/rig/plug.py`), 100 sines of 4 to 16 mm, 0.1 to 4 Hz, 0 to 1 A. None of the nine models made them. "
        "The constants of the plug at 0 and 1 A are fitted to Tables 1-2: the rows of these tables are recovered.",
        ["mrfit run pipelines/study-preyield.toml", f"mrfit measure quasi-static {SLOW}"],
        [*core(place), error_table(place), slow_table(place)],
        [],
        ["Fig. 1 (temperature): the paper prints no numbers."],
        figures(place),
    )
