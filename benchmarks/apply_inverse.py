"""The current for a force, given back to the model: ``python -m benchmarks.apply_inverse [--out FILE.md]``.

For every model of a force or torque, and the inverse-tanh paper's own, 10 000 random states: five steps of random
motion and current (seed 2), then the force that a random current gives. Error: the force under the current found, less
that force, over it (over 1 N where it is smaller); the greatest and the root mean square of all states.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.command import deliver
from mrfit.apply.inverse import Inverter, is_explicit
from mrfit.apply.solving import REACHED
from mrfit.apply.stepper import Stepper
from tests.apply.dampers import MODELS, STEP, controllable, paper_tanh, wandered

STATES, SEED = 10_000, 2
HEADS = ("model", "found", "states", "reached", "greatest error", "rms error")


def row(name: str, states: int) -> tuple[str, ...]:
    """Return a model's row of the table."""
    stepper = Stepper(paper_tanh() if name == "inverse-tanh paper" else controllable(name))
    state, following = wandered(stepper, np.random.default_rng(SEED), states)
    forces = stepper.inner(state, following, STEP, following["current"])
    found = Inverter(stepper).solve(state, following, STEP, forces)
    off = np.abs(stepper.inner(state, following, STEP, found.field) - forces) / np.maximum(np.abs(forces), 1.0)
    how = "closed form" if is_explicit(stepper.damper) else "Newton"
    reached = int(np.sum(found.flag == REACHED))
    return name, how, str(states), str(reached), f"{np.max(off):.1e}", f"{np.sqrt(np.mean(off**2)):.1e}"


def table(states: int) -> str:
    """Return the page."""
    rows = [row(name, states) for name in (*MODELS, "inverse-tanh paper")]
    text = [
        f"| {' | '.join(HEADS)} |",
        "|---|---|" + "---:|" * (len(HEADS) - 2),
        *(f"| {' | '.join(r)} |" for r in rows),
    ]
    return "\n".join(text) + "\n"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(prog="benchmarks.apply_inverse")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--states", type=int, default=STATES)
    options = parser.parse_args(arguments)
    about = (__doc__ or "").split("\n\n", 1)[1]
    command = "`python -m benchmarks.apply_inverse`."
    deliver(f"# The current for a force\n\n{command} {about.strip()}\n\n{table(options.states)}", options.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
