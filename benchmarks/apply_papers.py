"""What the papers do with their models, done again: ``python -m benchmarks.apply_papers [--out FILE.md]``.

The preyield paper's skyhook ride over a bump (Tables 3-4) from the parameters of its Tables 1-2; the inverse-tanh
paper's force tracking (Tables 4-5) from the force-current model of its Table 3 and the lag of its eq. 9.
"""

import argparse
from pathlib import Path

import numpy as np
from scipy.stats import spearmanr

from mrfit.apply.calls import track
from mrfit.apply.car import Car, Control, Timing, adaptive, drive, rms
from mrfit.apply.chatter import told_apart
from mrfit.apply.damper import Damper, damper
from mrfit.apply.motion import sine
from mrfit.apply.roads import Bump
from mrfit.apply.stepper import Stepper
from mrfit.apply.tracking import TrackingCase
from mrfit.io.schemas.apply import Chatter

# Preyield paper, Tables 1-2, at 0 and 1 A, in N, N*s/m, m/s (s/m for guo). MH of biviscous prints 1.8 and 4.1 mm/s for
# 18 and 41, which it has in the form that eq. 3 prints; Omega of guo is not printed and taken as 0, no loop
RIDE_PARAMETERS: dict[str, dict[str, dict[str, tuple[float, float]]]] = {
    "bingham": {
        "LMH": {"fy": (75.26, 963.1), "C_inf": (961.87, 3508.5)},
        "MH": {"fy": (89.67, 1046.7), "C_inf": (842.82, 2858.9)},
    },
    "biviscous": {
        "LMH": {"fy": (75.80, 823.5), "C_inf": (961.25, 4503.7), "vy": (0.0047, 0.0058)},
        "MH": {"fy": (86.28, 1005.0), "C_inf": (869.84, 3135.9), "vy": (0.018, 0.041)},
    },
    "biviscous-printed": {
        "LMH": {"fy": (75.80, 823.5), "C_inf": (961.25, 4503.7), "C0": (17124.0, 147230.0), "vy": (0.0047, 0.0058)},
        "MH": {"fy": (86.28, 1005.0), "C_inf": (869.84, 3135.9), "C0": (5612.0, 27392.0), "vy": (0.0018, 0.0041)},
    },
    "regularised-bingham": {
        "LMH": {"fy": (79.26, 845.5), "C_inf": (933.13, 4324.1), "vy": (0.0028, 0.0030)},
        "MH": {"fy": (89.80, 1137.0), "C_inf": (851.50, 2302.4), "vy": (0.0099, 0.0250)},
    },
    "hysteretic-biviscous": {
        "LMH": {"fy": (76.44, 837.4), "C_inf": (955.97, 4385.8), "C0": (20330.0, 162000.0), "vh": (0.0018, 0.0020)},
        "MH": {"fy": (90.76, 1027.5), "C_inf": (842.74, 2974.6), "C0": (7579.0, 40831.0), "vh": (0.0092, 0.0176)},
    },
    "hysteretic-regularised-bingham": {
        "LMH": {"fy": (80.40, 863.7), "C_inf": (924.53, 4195.1), "vy": (0.0027, 0.0030), "vh": (0.0017, 0.0020)},
        "MH": {"fy": (92.09, 1099.9), "C_inf": (829.93, 2436.5), "vy": (0.0070, 0.0163), "vh": (0.0079, 0.0162)},
    },
    "guo": {
        "LMH": {"fy": (79.11, 855.8), "C_inf": (934.93, 4293.8), "C0": (263.0, 222.0), "Omega": (0.0, 0.0)},
        "MH": {"fy": (90.60, 1084.7), "C_inf": (844.22, 2589.6), "C0": (85.0, 35.0), "Omega": (0.0, 0.0)},
    },
}
PRINTED_RIDE = {
    "bingham": (1.123, 1.178),
    "biviscous": (0.543, 0.627),
    "biviscous-printed": (0.543, 0.627),
    "regularised-bingham": (0.542, 0.596),
    "hysteretic-biviscous": (0.674, 1.516),
    "hysteretic-regularised-bingham": (0.531, 1.274),
    "guo": (0.541, 0.607),
}
CHATTERING = ("bingham", "hysteretic-biviscous", "hysteretic-regularised-bingham")
# Inverse-tanh paper, Table 3: order 1 to 0.2 A, order 2 from there, in N and mm
LOW_HIGH = {
    "fy": ((0.0, 579.6, 82.96), (-719.6, 1817.0, -135.7), 1.0),
    "c": ((0.0, 3.1, 0.71), (0.1429, 2.669, 0.84), 1e3),
    "f0": ((0.0, -19.95, -11.77), (16.28, -29.55, -11.67), 1.0),
}
# k and c in N/mm and N*s/mm, relative rmse in all and by region (Table 4)
PRINTED_TRACKING = (
    (0, 10, 0.111, 0.041, 0.103, None),
    (0, 20, 0.057, 0.031, 0.048, None),
    (50, 10, 0.134, None, 0.114, 0.071),
    (50, 20, 0.066, 0.030, 0.047, 0.035),
    (100, 10, 0.114, 0.067, 0.066, 0.065),
    (100, 20, 0.092, 0.062, 0.043, 0.052),
    (-50, 10, 0.098, 0.029, 0.085, 0.038),
    (-50, 20, 0.054, 0.028, 0.034, 0.031),
    (-100, 10, 0.067, 0.022, 0.052, 0.036),
    (-100, 20, 0.060, 0.028, 0.042, 0.031),
)
# What the paper names as sources of its errors and gives no numbers of: a field slower than the 20 ms of its step tests
# where the current rises steadily, and residual magnetism. Taken as 30 ms and 0.05 A
SLOWER, COERCIVE = 0.030, 0.05
# By how much later in velocity the preyield paper's simulation seems to have yielded
LATER = 10.0
RIDE_HEADS = (
    "| model | fit | on-off | adaptive | printed | on-off, yielding at ten times the velocity | passive 0 A "
    "| passive 1 A | paper: chatter or jumps | found, on-off | found, passive 1 A |",
    "|---|---|---|---|---|---|---|---|---|---|---|",
)
RIDE_WORDS = (
    "- The paper's rides without chatter come out within 1 % from its LMH rows. From its MH rows they come out "
    "at 0.53, not 0.60 to 0.63, but for biviscous in the form that eq. 3 prints, with the velocities 1.8 and 4.1 mm/s "
    "that its table prints: 0.628 at the steps, printed 0.627 (0.696 with the stages between them, where the force "
    "jumps back and forth). The fit has 18 and 41, the ride was simulated with a tenth. "
    "After the bump eq. 13 holds 1 A, which both fits make stiff below yielding: the car creeps to rest and the fits "
    "hardly differ. The paper sees a rebound there that MH damps less.",
    "- What was looked for does not explain MH: another time window (each row needs its own), the current switched "
    "off after the bump, a dead zone of the switch, a late current, yield velocities of 0 and 1 A exchanged. None puts "
    "MH more than 2 % above LMH.",
    "- One thing brings all six rows: yielding at ten times the printed velocities (guo's C0 a tenth), a slope before "
    "yielding ten times less. LMH then comes out within 0.4 %, MH within 4 %. A slip of millimetres in the paper's "
    "simulation would do that; its biviscous MH velocities 1.8 and 4.1 mm/s are a tenth of what its C0 has. This is a "
    "guess that fits, not a proof: the factor was chosen on these six numbers, from 0.5 to 20, and 12 to 14 fit a "
    "little better. The printed parameters are kept.",
    "- Herschel-Bulkley cannot be had from the print: no exponent between 0.3 and 1 that both currents share gives "
    "0.559 from LMH (0.578 at least), so that each current had its own. The polynomial and Spencer print none of what "
    "shapes their loop.",
    "- Bingham's force has no value at rest. Its ride depends on the solver: the adaptive one does not end. Fixed "
    "steps chatter as the paper's do, at a rate set by the step, and only a pre-yield slope takes that away.",
    "- The two branched models chatter in the paper and here. The branch is chosen by the acceleration one stage "
    "earlier; a force that falls as the acceleration turns positive raises it further: no rest between both "
    "branches. Where these lie close (LMH) the force trembles at 25 to 35 Hz, where apart (MH) a limit cycle of 9 "
    "to 11 Hz is left. Their rms is a matter of the solver, as Bingham's is.",
)
SCHEME_WORDS = (
    "On the model's own plant feedforward is exact but for the command's limit of 1.2, and feedback can only do worse. "
    "On the deviating plant Err_energy falls from feedforward over feedback to both, as Weber's does.",
)


def ride_damper(model: str, fit: str, later: float = 1.0) -> Damper:
    """Return a damper of the preyield paper: parameters at 0 and 1 A; it yields at ``later`` times the velocity."""
    scale = {"vy": later, "C0": 1.0 / later}
    printed = RIDE_PARAMETERS[model][fit].items()
    values = {n: (pair[0] * scale.get(n, 1.0), pair[1] * scale.get(n, 1.0)) for n, pair in printed}
    ends = {f"{n}@{k}A": pair[k] for n, pair in values.items() for k in (0, 1)}
    return damper(model, {**ends, "f0": 0.0}, dict.fromkeys(values, 1))


def inverse_tanh(**effects: float) -> Damper:
    """Return the inverse-tanh paper's force-current model with effects' parameters, as ``lag_tau``."""
    values = {"k": 270.0, "a1@0.1A": 100.0, "a1@0.6A": 75.0, "a2@0.1A": 65.0, "a2@0.6A": 80.0}
    for name, (low, high, unit) in LOW_HIGH.items():
        for current, row, side in ((0.0, low, ""), (0.2, low, "-"), (0.2, high, "+"), (0.6, high, ""), (1.0, high, "")):
            values[f"{name}@{current:g}A{side}"] = unit * float(np.polyval(row, current))
    names = {"tau": "current-lag.tau", "w": "residual-magnetism.w"}
    more = {names[n]: value for n, value in effects.items()}
    model = "+".join(["tanh", *dict.fromkeys(n.partition(".")[0] for n in more)])
    pieces = dict.fromkeys(LOW_HIGH, "1/0.2/2") | dict.fromkeys(("a1", "a2"), "0/0.2/0")
    return damper(model, {**values, **more}, pieces)


def ride_rows(sample: float) -> list[str]:
    """Return the table of rides: rms of the sprung acceleration, chatter and its cause."""
    car, timing, rows = Car(500.0, 0.0, 78e3), Timing(sample, 1), list[str]()
    for model, fits in RIDE_PARAMETERS.items():
        for k, fit in enumerate(fits):
            stepper = Stepper(ride_damper(model, fit))
            pairs = [(Control(name), Bump()) for name in ("skyhook-on-off", "passive-low", "passive-high")]
            rides = drive(stepper, car, pairs, timing)

            def again(some, changed, lagless, stepper=stepper):  # type: ignore[no-untyped-def]
                return drive(stepper, car, [(r.control, r.road) for r in some], changed)

            found = told_apart(rides, timing, car.fastest, again, lags=False)
            check = adaptive(stepper, car, pairs[0], Timing(1e-3, 1))
            free = f"{check.acceleration:.3f}" if check.ended == check.duration else f"no end, {check.ended:.2f} s"
            values = [rms(ride.acceleration) for ride in rides]
            late = "–"
            if model not in (*CHATTERING, "biviscous-printed"):
                ride = drive(Stepper(ride_damper(model, fit, LATER)), car, pairs[:1], timing)[0]
                late = f"{rms(ride.acceleration):.3f}"
            row = (model, fit, f"{values[0]:.3f}", free, f"{PRINTED_RIDE[model][k]:.3f}", late, f"{values[1]:.3f}")
            paper = "yes" if model in CHATTERING else "no"
            rows.append(
                " | ".join(["", *row, f"{values[2]:.3f}", paper, oddity(found[0]), oddity(found[2]), ""]).strip()
            )
            print(rows[-1], flush=True)
    return rows


def oddity(one: Chatter) -> str:
    """Return what was found of a ride, in a few words."""
    kinds = [f"chatter {one.rate:.0f} Hz, {100 * one.share:.0f} % of the time"] if one.found else []
    kinds += [f"limit cycle {one.limit_cycle:.3g} Hz"] if one.limit_cycle and not one.found else []
    kinds += [f"{one.jumps:.1f} jumps/s"] if one.jumps >= 1.0 and not one.found else []
    return "; ".join(kinds) + (f" ({one.cause})" if one.cause else "") or "–"


def tracked(plant: Damper) -> list[TrackingCase]:
    """Return the paper's ten laws at 1 Hz and 10 mm by every scheme, on a plant."""
    laws = [f"k={1e3 * k:g},c={1e3 * c:g}" if k else f"c={1e3 * c:g}" for k, c, *_ in PRINTED_TRACKING]
    return [c for c in track(inverse_tanh(tau=0.02), sine(1.0, 0.01, 3.0), laws, plant=plant).cases if c.lag]


def tracking_rows(same: list[TrackingCase], other: list[TrackingCase]) -> tuple[list[str], list[str]]:
    """Return the table beside Table 4, and what its orderings are."""
    own, off = ([c for c in cases if c.scheme == "feedforward"] for cases in (same, other))
    rows = []
    for (k, c, *printed), one, two in zip(PRINTED_TRACKING, own, off, strict=True):
        cells = [f"{v:.3f}" if v is not None else "–" for v in printed]
        for case in (one, two):
            cells += [f"{case.error:.3f}", *("–" if np.isnan(r.error) else f"{r.error:.3f}" for r in case.regions)]
        rows.append("| " + " | ".join([str(k), str(c), *cells]) + " |")
    words = []
    total = np.array([row[2] for row in PRINTED_TRACKING])
    for name, cases in (("own model", own), ("deviating plant", off)):
        errors = np.array([c.error for c in cases])
        rank = float(spearmanr(total, errors).statistic)
        softer = int(np.sum(errors[0::2] > errors[1::2]))
        stiff = int(np.sum(errors[2:6] > errors[6:10]))
        words.append(
            f"- {name}: more damping tracks better in {softer} of 5 pairs (paper 5 of 5), negative stiffness better "
            f"than positive in {stiff} of 4 (paper 4 of 4); rank correlation with the paper's ten totals {rank:.2f}"
        )
    return rows, words


def scheme_rows(same: list[TrackingCase], other: list[TrackingCase]) -> list[str]:
    """Return the means over all laws of each scheme, beside Table 5."""
    printed = {
        "feedforward": "0.0584 / 0.0399 (this scheme); – / 0.0733 (FF Weber)",
        "feedback": "– / 0.0441 (FB Weber)",
        "both": "– / 0.0236 (FFFB Weber)",
        "uninverted": "–",
    }
    rows = []
    for scheme, paper in printed.items():
        cells = []
        for cases in (same, other):
            some = [c for c in cases if c.scheme == scheme]
            means = [np.mean([getattr(c, n) for c in some]) for n in ("error", "err_peak", "err_energy")]
            cells += [f"{m:.4f}" for m in means]
        rows.append("| " + " | ".join([scheme, *cells, paper]) + " |")
    return rows


def main() -> None:
    """Print the tables, and write them where asked to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, help="file for the tables")
    parser.add_argument("--sample", type=float, default=4e-4, help="step of the rides in s")
    chosen = parser.parse_args()
    same, other = tracked(inverse_tanh(tau=0.02)), tracked(inverse_tanh(tau=SLOWER, w=COERCIVE))
    rows, words = tracking_rows(same, other)
    lines = [
        "# What the papers do with their models",
        "",
        "`python -m benchmarks.apply_papers --out docs/benchmarks/apply_papers.md`",
        "",
        "## On-off skyhook over a bump (preyield paper, Tables 3-4)",
        "",
        f"Rms of the sprung acceleration in m/s² over 3 s; fixed steps of {1e3 * chosen.sample:g} ms, the control at "
        "every step; adaptive: RK45, the control every ms. Herschel-Bulkley's exponent, the polynomial's coefficients "
        "and the shape of Spencer's loop are not printed, so that these three rows are missing.",
        "",
        *RIDE_HEADS,
        *ride_rows(chosen.sample),
        "",
        *RIDE_WORDS,
        "",
        "## Force tracking (inverse-tanh paper, Table 4)",
        "",
        "Relative rms errors of feedforward at 1 Hz and 10 mm, in all and in regions I, II, III: printed, on a plant "
        f"that is the model, and on one that deviates as the paper says its damper did (field lag {1e3 * SLOWER:g} ms "
        f"where the model has 20, residual magnetism {COERCIVE:g} A: our numbers, it prints none).",
        "",
        "| k (N/mm) | c (N·s/mm) | printed | I | II | III | own model | I | II | III | deviating | I | II | III |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|",
        *rows,
        "",
        *words,
        "",
        "## Schemes (inverse-tanh paper, Table 5)",
        "",
        "Means over the ten laws: relative rms error, Err_rms_f, Err_energy.",
        "",
        "| scheme | own model: rmse | Err_rms_f | Err_energy | deviating: rmse | Err_rms_f | Err_energy "
        "| printed Err_rms_f / Err_energy |",
        "|---|---|---|---|---|---|---|---|",
        *scheme_rows(same, other),
        "",
        *SCHEME_WORDS,
        "",
    ]
    print("\n".join(lines))
    if chosen.out:
        chosen.out.write_text("\n".join(lines), encoding="utf-8")


if __name__ == "__main__":
    main()
