"""Default joint fits and laws of current: ``python -m benchmarks.current_dependence [SEED ...] [--out FILE.md]``.

Planted models under sines at five currents; the fits are judged at four currents between these, by the RMS error there
in units of the sensor's noise, 1 being as good as the truth. Three defaults side by side on the same logs: orders by
role, as mrfit had them before it chose; form and order chosen on held-out currents; and the planted form told to it,
which for laws that are no polynomial is the truth itself. Seeds below 100 are those the choice was made on.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import math  # noqa: E402
import re  # noqa: E402
import sys  # noqa: E402
import tempfile  # noqa: E402
import time  # noqa: E402
from collections.abc import Callable, Mapping  # noqa: E402
from pathlib import Path  # noqa: E402

import numpy as np  # noqa: E402

from mrfit.core.recording import Recording, Segment  # noqa: E402
from mrfit.fit import stage as fit_stage  # noqa: E402
from mrfit.io.workspace import Workspace  # noqa: E402
from mrfit.simulate.assembly import assemble  # noqa: E402
from mrfit.simulate.current_levels import default_orders  # noqa: E402

TRAINED, HELD_OUT = (0.0, 0.25, 0.5, 0.75, 1.0), (0.1, 0.35, 0.6, 0.9)
# Sines: Hz, and amplitude in m, or rad / 60
SINES = ((0.5, 0.002), (1.0, 0.01), (2.0, 0.008))
PER_CYCLE, CYCLES = 200, 6
# Noise as a share of the greatest output
NOISE = 0.003
DEVELOPMENT, FRESH = (1, 2), (101, 102)
TITLE = """# Dependence on current: error at currents held out, in units of the noise

`python -m benchmarks.current_dependence [SEED ...] [--out FILE.md]`

"""

# Per model its yield force, its damping and a parameter of either sign, with the scale of each
MODELS: Mapping[str, tuple[tuple[str, float], tuple[str, float], tuple[str, float]]] = {
    "bingham": (("fy", 500.0), ("C_inf", 1000.0), ("f0", 200.0)),
    "tanh": (("fy", 500.0), ("c", 1000.0), ("k", 2e4)),
    "guo": (("fy", 500.0), ("C_inf", 1000.0), ("Omega", 2.0)),
    "hysteretic-biviscous": (("fy", 500.0), ("C_inf", 1000.0), ("vh", 0.002)),
    "boucwen": (("alpha", 500.0), ("c", 1000.0), ("x0", 0.1)),
    "spencer": (("alpha", 500.0), ("C_inf", 2000.0), ("K0", 1e4)),
    "rotational-erf": (("alpha", 4.0), ("c", 1.0), ("k", 30.0)),
}
Law = Callable[[float], float]
# Per law of the yield force, as a multiple of its scale: the law, and what --current-order says, empty for none
LAWS: Mapping[str, tuple[Law, str]] = {
    "constant": (lambda i: 1.0, ""),
    "parabola": (lambda i: 0.2 + 3.0 * i - 1.2 * i * i, "plain2"),
    "exponential": (lambda i: 0.2 * float(np.exp(2.3 * i)), "log1"),
    "saturation": (lambda i: 0.2 + 1.8 * (1.0 - float(np.exp(-i / 0.4))), "none"),
    "sign": (lambda i: 0.2 + 1.8 * i, "plain1"),
}


def planted(model: str, law: str, current: float) -> np.ndarray:
    """Return the parameters (K,) at a current; damping doubles unless all is constant, ``sign`` turns one's sign."""
    spec = assemble(model).spec
    (strength, scale), (viscous, damping), (signed, size) = MODELS[model]
    values = dict(zip(spec.names, spec.start.tolist(), strict=True))
    values[strength] = scale * LAWS[law][0](current)
    values[viscous] = damping * (1.0 if law == "constant" else 1.0 + current)
    if law == "sign":
        values[signed] = size * (1.4 * current - 0.4)
    return np.array([values[n] for n in spec.names])


def order_of(model: str, law: str) -> str:
    """Return the planted form as --current-order writes it."""
    (strength, _), (viscous, _), (signed, _) = MODELS[model]
    form = LAWS[law][1]
    if not form:
        return "0"
    return f"{strength}={form},{viscous}=plain1" + (f",{signed}=1" if law == "sign" else "")


def workspace(folder: Path, model: str, law: str, seed: int) -> tuple[Workspace, float]:
    """Return the logs of a planted model, those between the trained currents held out, and the noise's deviation."""
    assembly, rng = assemble(model), np.random.default_rng(seed)
    names, scale = (("displacement", "velocity", "acceleration"), 1.0)
    if assembly.spec.output == "torque":
        names, scale = ("angle", "angular_velocity", "angular_acceleration"), 60.0
    segments, clean = [], []
    for current in (*TRAINED, *HELD_OUT):
        for hertz, amplitude in SINES:
            rate, count = 2.0 * np.pi * hertz, (CYCLES + 1) * PER_CYCLE
            phase = 2.0 * np.pi * (np.arange(count) + 0.25) / PER_CYCLE
            moved = (np.sin(phase), rate * np.cos(phase), -(rate**2) * np.sin(phase))
            channels = {n: scale * amplitude * v for n, v in zip(names, moved, strict=True)}
            drive = np.stack([channels[n] for n in assembly.spec.inputs])
            dt = 1.0 / (hertz * PER_CYCLE)
            output = assembly.simulate(drive, planted(model, law, current)[None, :], dt)[0]
            name = f"{hertz:g}Hz-{current:g}A"
            clean.append((name, dt, channels, output, current))
            segments.append(
                Segment(
                    f"{name}#1", name, name, PER_CYCLE, count, PER_CYCLE, "sine", names[0], hertz, scale * amplitude,
                    0.0, CYCLES, current, float("nan"), "train" if current in TRAINED else "holdout",
                )
            )  # fmt: skip
    noise = NOISE * max(float(np.ptp(output)) for _, _, _, output, _ in clean)
    made = Workspace(folder)
    for name, dt, channels, output, current in clean:
        measured = output + noise * rng.standard_normal(len(output))
        held = {"current": np.full(len(output), current), **channels, assembly.spec.output: measured}
        made.write_recording(Recording(name, name, "0", "none", dt, 0.0, held, {}, {}, {"current": current}))
    made.write_segments(segments, {})
    return made, noise


def error(made: Workspace, model: str, order: str, noise: float) -> tuple[float, float, str]:
    """Return the error on held-out currents in units of the noise, the seconds a fit took, and its orders."""
    begin = time.perf_counter()
    name = "fit-" + re.sub(r"[^\w.-]", "-", order)
    settings = fit_stage.Settings(model, per="all", current_order=order, name=name)
    fit = fit_stage.run(made, settings)
    whole = fit.pooled("holdout")
    orders = fit.current_dependence.orders if fit.current_dependence else {}
    return (
        (whole.rmse if whole and whole.rmse else math.nan) / noise,
        time.perf_counter() - begin,
        ",".join(f"{n}={o}" for n, o in orders.items()) or "0",
    )


def row(model: str, law: str, seed: int) -> tuple[list[str], list[float]]:
    """Return the cells of one case, and the errors and seconds of the three fits."""
    before = ",".join(f"{n}={o}" for n, o in default_orders(assemble(model).spec, len(TRAINED)))
    with tempfile.TemporaryDirectory() as folder:
        made, noise = workspace(Path(folder), model, law, seed)
        old, old_seconds, _ = error(made, model, before, noise)
        new, new_seconds, chosen = error(made, model, "auto", noise)
        told = 1.0 if LAWS[law][1] == "none" else error(made, model, order_of(model, law), noise)[0]
    text = [f"{e:.3g}" if e >= 1.095 else f"{e:.2f}" for e in (old, new, told)]
    cells = [model, law, str(seed), *text, f"`{chosen}`", f"{old_seconds:.1f}", f"{new_seconds:.1f}"]
    return cells, [old, new, told, old_seconds, new_seconds]


def main(seeds: tuple[int, ...], out: Path | None) -> None:
    """Print the table, and write it where that is asked for."""
    head = ["model", "law", "seed", "by role", "chosen", "planted form", "orders chosen", "by role (s)", "chosen (s)"]
    lines = ["| " + " | ".join(head) + " |", "|" + " --- |" * len(head)]
    print("\n".join(lines), flush=True)
    found = []
    for seed in seeds:
        for model in MODELS:
            for law in LAWS:
                cells, numbers = row(model, law, seed)
                found.append((seed, numbers))
                lines.append("| " + " | ".join(cells) + " |")
                print(lines[-1], flush=True)
    for kind, own in (("development", [n for s, n in found if s < 100]), ("fresh", [n for s, n in found if s >= 100])):
        if own:
            old, new, told, *seconds = np.array(own).T
            said = (
                f"{kind} seeds, {len(own)} cases: by role median {np.median(old):.3g}, worst {old.max():.3g}; chosen "
                f"median {np.median(new):.3g}, worst {new.max():.3g}; planted form median {np.median(told):.3g}, worst "
                f"{told.max():.3g}; time chosen / by role {seconds[1].sum() / seconds[0].sum():.2f}"
            )
            lines += ["", said]
            print(f"\n{said}")
    if out:
        out.write_text(TITLE + "\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    words = sys.argv[1:]
    target = Path(words[words.index("--out") + 1]) if "--out" in words else None
    asked = tuple(int(w) for w in words if w.isdecimal())
    main(asked or (*DEVELOPMENT, *FRESH), target)
