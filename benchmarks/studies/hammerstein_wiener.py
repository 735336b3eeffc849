"""Hammerstein-Wiener paper: stages, factor of temperature, bandwidths, blocks left out, and the network."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import mrfit
from benchmarks.studies.figures import Curve, Panel, draw
from benchmarks.studies.page import AT_MOST, Row, Study, Table, claim, compare
from benchmarks.studies.runs import Place, errors, fit_file, parameters, pipeline
from datasets.studies.hammerstein_wiener import DEAD_TIME, FIELD_LAGS, REFERENCE, alpha

FITS = ("static", "static-hysteresis", "static-magnetisation", "complete", "network", "network-25")
NAMES = {
    "static-hysteresis": "static + hysteresis",
    "static-magnetisation": "static + magnetisation",
    "network": "network, all tests",
    "network-25": "network, tests at 25 °C",
}
ROADS = {"25 °C": "road_25degC", "−20 °C": "road_-20degC"}
# The network has no temperature, as in the paper; one at 25 degC judges the structures
JUDGED = "25 °C"
ORDERS = (1, 2, 3)


def recording(place: Place, log: str, warm: bool = True, scatter: float = 0.0) -> Any:
    """Return a log, as if its oil were at 25 degC or its force scattered more (N) where asked for."""
    found = mrfit.read(str(place.logs / f"{log}.csv"))[0]
    channels = dict(found.channels)
    if not warm:
        channels["temperature"] = np.full(found.samples, REFERENCE)
    channels["force"] = channels["force"] + np.random.default_rng(0).normal(0.0, scatter, found.samples)
    return [replace(found, channels=channels)]


@cache
def judged(place: Place, fit: str, road: str, warm: bool = True, scatter: float = 0.0) -> tuple[float, float]:
    """Return RMS error in N and ESR in % of a fit on a road that it has not seen."""
    loaded = mrfit.load(place.work / "fits" / fit / "fit.json")
    last = mrfit.predict(loaded, recording(place, ROADS[road], warm, scatter)).metrics.iloc[-1]
    return float(last["rmse"]), float(last["esr"])


def ablation_table(place: Place) -> Table:
    """Return Fig. 16: RMS and ESR of the structures on the road at 25 degC, and the RMS on the tests fitted."""
    rows = []
    for fit in FITS:
        rms, esr = judged(place, fit, JUDGED)
        paper: list[float | None] = [None, 5.8 if fit == "complete" else None, None]
        rows.append(Row(NAMES.get(fit, fit), paper, [rms, esr, errors(fit_file(place.work, fit), "rmse")["all"]]))
    heads = ["RMS", "ESR", "RMS on the tests fitted"]
    note = "Of the bars only the ESR of the complete model is printed. The paper's bench repeats to about 100 N."
    return Table("RMS error in N and ESR in % on the road at 25 °C", "Fig. 16", "model", heads, rows, note)


def ablation_words(place: Place, scatter: float = 0.0) -> Table:
    """Return what section 4 says of Figs. 16 to 18, on a bench whose force scatters more (N)."""
    rms = {fit: judged(place, fit, JUDGED, scatter=scatter)[0] for fit in FITS}
    size = [q for q in fit_file(place.work, "network")["results"][0]["parameters"]]
    cold, blind = (judged(place, "complete", "−20 °C", warm, scatter)[0] for warm in (True, False))
    apart = rms["complete"] - min(rms["network"], rms["network-25"])
    esr = judged(place, "complete", JUDGED, scatter=scatter)[1]
    rows = [
        claim(
            "every block lowers the error",
            "static > with H, with M > complete",
            " > ".join(f"{rms[f]:.3g}" for f in ("static", "static-hysteresis", "static-magnetisation", "complete"))
            + " N",
            rms["complete"] < min(rms["static-hysteresis"], rms["static-magnetisation"])
            and max(rms["static-hysteresis"], rms["static-magnetisation"]) < rms["static"],
        ),
        claim(
            "magnetisation matters most for modulated current",
            "M lowers the error more than H",
            f"M to {rms['static-magnetisation']:.3g} N, H to {rms['static-hysteresis']:.3g} N",
            rms["static-magnetisation"] < rms["static-hysteresis"],
        ),
        claim(
            "against the network",
            "network better by less than 50 N",
            f"network {'better' if apart > 0 else 'worse'} by {abs(apart):.3g} N",
            0.0 < apart < 50.0,
        ),
        claim("parameters of the network", "31", f"{len(size)}", len(size) == 31, "recovered", "equal"),
        compare("ESR of the complete model, %", [5.8], [esr], AT_MOST, "number"),
        claim(
            "road at −20 °C with and without α(T)",
            "error falls as the oil warms towards 25 °C; α removes it",
            f"{cold:.3g} N with, {blind:.3g} N without",
            cold < 0.5 * blind,
            rule="less than half of it",
        ),
    ]
    return Table("What section 4 says", "section 4", "of", [], rows)


def unit_lags(place: Place) -> tuple[NDArray[np.complex128], NDArray[np.complex128], NDArray[np.float64]]:
    """Return the fitted H and M over frequency, and the frequencies in Hz."""
    p = parameters(fit_file(place.work, "complete")["results"][0])
    hz = np.geomspace(0.1, 500.0, 4000)
    s = 2j * np.pi * hz
    poles = np.prod([p[f"p{k}"] / (s + p[f"p{k}"]) for k in (1, 2, 3, 4)], axis=0)
    h = poles * (s**2 + 2.0 * p["xi"] * p["omega"] * s + p["omega"] ** 2) / p["omega"] ** 2
    m = p["q1"] * p["q2"] / p["zero"] * (s + p["zero"]) / ((s + p["q1"]) * (s + p["q2"]))
    return h, m, hz


def bandwidth(gain: NDArray[np.complex128], hz: NDArray[np.float64]) -> float:
    """Return the frequency in Hz at which a unit gain has fallen by 3 dB."""
    below = np.flatnonzero(np.abs(gain) < np.sqrt(0.5))
    return float(hz[below[0]]) if len(below) else float("nan")


def block_table(place: Place) -> Table:
    """Return what sections 3.1 to 3.3 say of temperature, hysteresis and magnetisation."""
    h, m, hz = unit_lags(place)
    true = np.prod([1.0 / (1.0 + 2j * np.pi * hz * lag) for lag in FIELD_LAGS], axis=0)
    wide, given = bandwidth(m, hz), bandwidth(true, hz)
    p = parameters(fit_file(place.work, "complete")["results"][0])
    drop, better = temperature(place)
    form = fit_file(place.work, "complete")["form_choice"]
    rows = [
        claim(
            "bandwidth of M",
            "about 30 Hz",
            f"{wide:.3g} Hz, delay {1e3 * p['tau']:.2g} ms (rig {given:.3g} Hz, {1e3 * DEAD_TIME:.2g} ms)",
            abs(wide / given - 1.0) < 0.25 and 20.0 < wide < 45.0,
            "recovered",
            "within 25 % of the rig's, 20 to 45 Hz",
        ),
        claim(
            "H is unit gain, and slower loops are narrower",
            "wider with frequency",
            f"−3 dB at {bandwidth(h, hz):.3g} Hz",
            bandwidth(h, hz) > 5.0,
            rule="−3 dB above 5 Hz",
        ),
        claim(
            "maximal force over temperature, Fig. 8",
            "falls by more than 57 % over 80 °C, steepest in the cold",
            f"falls by {100 * drop:.3g} % over 80 °C",
            drop > 0.5,
            "recovered",
            "one-sided: by more than 50 %",
        ),
        claim(
            "α(T), inside the joint fit",
            "a polynomial serves",
            form["text"][0].partition(": ")[2],
            form["chosen"].startswith("polynomial"),
        ),
        claim(
            "α(T), peaks of the heating alone",
            "a polynomial serves",
            f"by AICc: {better}",
            better.startswith("polynomial"),
        ),
    ]
    return Table("What section 3 says of the blocks", "section 3", "of", [], rows)


@cache
def peaks(place: Place) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return temperature and greatest force, less the offset, of every cycle of the heating."""
    log = recording(place, "heating_2.5Hz")[0]
    frame, size = log.to_frame(), round(0.4 / log.dt)
    cycles = [frame.iloc[k : k + size] for k in range(0, len(frame) - size + 1, size)]
    warm = np.array([float(c["temperature"].mean()) for c in cycles])
    force = np.array([float(c["force"].quantile(0.98) - c["force"].quantile(0.02)) / 2.0 for c in cycles])
    return warm, force


def temperature(place: Place) -> tuple[float, str]:
    """Return the fall of the maximal force over 80 K, and which form of alpha(T) the peaks prefer, by AICc."""
    warm, force = peaks(place)
    n, scores = len(warm), {}
    x = (warm - REFERENCE) / 50.0

    def score(left: NDArray[np.float64], count: int) -> float:
        k = count + 1
        return float(n * np.log(np.mean(left**2)) + 2.0 * k + 2.0 * k * (k + 1) / (n - k - 1))

    line = np.polyfit(x, np.log(force), 1)
    scores["exponential"] = score(force - np.exp(np.polyval(line, x)), 2)
    for order in ORDERS:
        scores[f"polynomial of order {order}"] = score(force - np.polyval(np.polyfit(x, force, order), x), order + 1)
    best = min(scores, key=scores.__getitem__)
    cubic = np.polyfit(x, force, 3)
    at = [float(np.polyval(cubic, (t - REFERENCE) / 50.0)) for t in (-5.0, 75.0)]
    others = ", ".join(f"{k} {v - scores[best]:.0f}" for k, v in scores.items() if k != best)
    return 1.0 - at[1] / at[0], f"{best} (ΔAICc of the others: {others})"


def stage_table(place: Place) -> Table:
    """Return the stages of the identification."""
    rows = [
        Row(f"{s['stage']} on {s['test']}", [], [float(len(s["segments"])), s["cost"]])
        for s in fit_file(place.work, "complete")["results"][0]["stages"]
    ]
    return Table("Stages of the identification", "section 3", "stage", ["segments", "RMS error, N"], rows)


def figures(place: Place) -> list[tuple[str, str]]:
    """Write the normalised step, the maximal force over temperature, and the road."""
    warm, force = peaks(place)
    reach = np.linspace(-22.0, 75.0, 60)
    at_reference = float(np.interp(REFERENCE, warm, force))
    road = recording(place, ROADS[JUDGED])
    frame = mrfit.predict(mrfit.load(place.work / "fits" / "complete" / "fit.json"), road).to_frame()
    part = frame[(frame["time"] > 3.0) & (frame["time"] < 3.4)]
    step = recording(place, "step_1.6A")
    shown = mrfit.predict(mrfit.load(place.work / "fits" / "complete" / "fit.json"), step).to_frame()
    shown = shown[(shown["time"] > shown["time"].iloc[0] + 1.2) & (shown["time"] < shown["time"].iloc[0] + 1.35)]
    scale = float(np.ptp(shown["measured"])) or 1.0
    zero = float(shown["measured"].min())
    time = shown["time"].to_numpy()
    panels = [
        Panel(
            "current step (Fig. 14)",
            ("time, s", "normalised"),
            [
                Curve(time, (shown["measured"].to_numpy() - zero) / scale, "measured", 5),
                Curve(time, (shown["simulated"].to_numpy() - zero) / scale, "complete", 1),
                Curve(time, shown["current"].to_numpy() / 1.6, "current", 2, "--"),
            ],
        ),
        Panel(
            "maximal force (Fig. 8)",
            ("temperature, °C", "over that at 25 °C"),
            [Curve(warm, force / at_reference, "peaks", 5, "", "."), Curve(reach, alpha(reach), "rig's α(T)", 1)],
        ),
        Panel(
            "road at 25 °C (Fig. 17)",
            ("time, s", "force, N"),
            [
                Curve(part["time"].to_numpy(), part["measured"].to_numpy(), "measured", 5),
                Curve(part["time"].to_numpy(), part["simulated"].to_numpy(), "complete", 1),
            ],
        ),
    ]
    draw("hammerstein-wiener.svg", panels)
    return [("hammerstein-wiener.svg", "A step of the current, the maximal force over temperature, and the road")]


CHECKS = {"the bench repeats to 100 N, as the paper's": lambda place: [ablation_words(place, 100.0)]}


def run(logs: Path, work: Path) -> Study:
    """Run the study."""
    place = Place(logs, work)
    pipeline("hammerstein-wiener", place)
    return Study(
        "hammerstein-wiener",
        "A Hammerstein-Wiener damper",
        "Savaia, Panzani, Corno, Cecconi, Savaresi, Hammerstein-Wiener modeling of a magneto-rheological damper",
        "Rig: a smooth static map, an oil column, two field lags and a dead time, α(T) = exp(B/(T + C)) "
        "(`datasets/studies/hammerstein_wiener.py`); 5000 samples a second; the paper's four kinds of tests, "
        "and two roads held out.",
        ["mrfit run pipelines/study-hammerstein-wiener.toml"],
        [stage_table(place), block_table(place), ablation_table(place), ablation_words(place)],
        [],
        ["Tables 1-2 (poles and zeros of H and M): lost in the scan."],
        figures(place),
    )
