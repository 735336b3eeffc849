"""What a step of the exported C costs: ``python -m benchmarks.export_speed [--out FILE.md]``.

Every model with parameters at its start values, some with effects, compiled by the C compiler at -O2, on a stroke of
two sines under a moving current at 10 kHz: nanoseconds per step, best of five runs of 50 000 steps, in double and in
float, and over those of tanh in double. Difference: largest from the simulation in Python, as a share of the range.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from mrfit.core import registry
from mrfit.export.c import built, rendered, user_inputs
from mrfit.export.c_parts import Parts, parts_of
from mrfit.export.causality import Cost
from mrfit.export.compiler import run_compiler
from mrfit.export.source import ExportSource
from mrfit.simulate.current_dependence import CurrentDependence, orders_of
from tests.export.rigs import rig

RUNS, STEPS = 5, 50_000
WITH = (
    "boucwen+coulomb-friction+asymmetry",
    "hw-static+current-filter+force-filter",
    "tanh+delay+temperature",
    "boucwen-flux+eddy-current",
)
DEPENDING = (("tanh", "fy=2,c=1"), ("boucwen", "alpha=2,c=1"), ("boucwen", "kappa=2,n=1"), ("spencer", "2"))
TIMER = """#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include "{p}.h"
int main(void) {{
    static {p}_inputs in[{steps}];
    static double row[{columns}], measured[{steps}];
    static {p}_{state} state; {p}_outputs out; {more} double best = 1e30, sum = 0.0; int k, r;
    for (k = 0; k < {steps}; k++) {{
        if (fread(row, sizeof(double), {columns}, stdin) != {columns}) return 1;
        {assign}
        measured[k] = row[{columns} - 1];
    }}
    for (r = 0; r < {runs}; r++) {{
        struct timespec a, b;
        {p}_{init}(&state);
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &a);
        for (k = 0; k < {steps}; k++) {{ {p}_{step} sum += (double)out.{output}; }}
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &b);
        {{
            const double ns = ((double)(b.tv_sec - a.tv_sec) * 1e9 + (double)(b.tv_nsec - a.tv_nsec)) / {steps};
            best = ns < best ? ns : best;
        }}
    }}
    printf("%.6g %.6g\\n", best, sum);
    return 0;
}}
"""


def timed(source: ExportSource, parts: Parts, files: dict[str, str], options: Sequence[str]) -> float:
    """Return nanoseconds per step."""
    import subprocess

    p = parts.context.p
    drive = source.drive(source.stretches[0])
    rows = np.tile(user_inputs(source, drive), (1, STEPS // drive.shape[1] + 1))[:, :STEPS]
    assign = " ".join(f"in[k].{c.field} = ({p}_real)row[{k}];" for k, c in enumerate(parts.context.inputs))
    output = parts.context.output.field
    own = {"state": "state", "init": "init", "step": f"step(&state, &in[k], ({p}_real)1e-4, &out);", "more": ""}
    if parts.tracker:
        step = f"track(&state, &in[k], ({p}_real)measured[k], ({p}_real)1e-4, &out, &found);"
        own = {"state": "tracker", "init": "tracker_init", "step": step, "more": f"{p}_estimates found;"}
        log = source.stretches[0].measured
        rows = np.vstack([rows, np.tile(log, STEPS // len(log) + 1)[:STEPS]])
    main = TIMER.format(p=p, steps=STEPS, runs=RUNS, columns=len(rows), assign=assign, output=output, **own)
    with TemporaryDirectory() as folder:
        place = Path(folder)
        for name, text in {f"{p}.h": files[f"{p}.h"], f"{p}.c": files[f"{p}.c"], "main.c": main}.items():
            (place / name).write_text(text)
        program = place / "timed"
        run_compiler(
            ["-std=c99", "-O2", *options, place / f"{p}.c", place / "main.c", "-lm", "-o", program], folder, "timer"
        )
        data = np.ascontiguousarray(rows.T).tobytes()
        found = subprocess.run([program], input=data, capture_output=True, check=True, text=False).stdout
    return float(found.split()[0])


def sources() -> list[tuple[str, ExportSource]]:
    """Return what is timed, by name."""
    found = [(name, rig(name, dt=1e-4)) for name in (*registry.names("model"), *WITH)]
    for name, orders in DEPENDING:
        dependence = CurrentDependence(orders_of(registry.load("model", name).SPEC, orders), 0.1, 1.5)
        found.append((f"{name}, {orders} in current", rig(name, dependence, dt=1e-4)))
    return found


def table() -> str:
    """Return the table."""
    rows = ["| model | double, ns | float, ns | double over tanh | difference |", "|---|---|---|---|---|"]
    unit = 0.0
    measured = []
    for name, source in sources():
        parts = parts_of(source)
        files = rendered(source, parts, [], Cost((), 0.002))
        times = [timed(source, parts, files, o) for o in ((), (f"-D{parts.context.p.upper()}_FLOAT",))]
        drive = source.drive(source.stretches[0])
        wanted = source.simulate(drive, 1e-4)
        with built(parts, files, ("-O2",)) as program:
            off = np.abs(program.run(user_inputs(source, drive), 1e-4)[0] - wanted).max() / np.ptp(wanted)
        measured.append((name, *times, off))
        unit = times[0] if name == "tanh" else unit
    rows += [f"| {name} | {a:.0f} | {b:.0f} | {a / unit:.1f} | {off:.1g} |" for name, a, b, off in measured]
    return "\n".join(rows) + "\n"


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table; ``--out`` writes it as a page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args(arguments)
    found = table()
    sys.stdout.write(found)
    if asked.out:
        text = (__doc__ or "").split("\n\n")[1].strip()
        page = f"# What a step of the exported C costs\n\n`python -m benchmarks.export_speed`. {text}\n\n{found}"
        asked.out.write_text(page)


if __name__ == "__main__":
    main()
