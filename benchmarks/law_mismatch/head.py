"""What the report says of itself: splits, laws, drives, what is hidden, what counts."""

from benchmarks.law_mismatch.faults import LIBRARY, OUTSIDE
from benchmarks.law_mismatch.laws import FAMILIES, RELAXATION, TRAVEL
from benchmarks.law_mismatch.motions import DRIVES
from benchmarks.law_mismatch.protocol import BASES
from benchmarks.law_mismatch.specimen import RATES, SAMPLES


def explanation(split: str) -> str:
    """Return the paragraphs at the head of a report."""
    laws = {s: [f"`{n}`: {f.title}" for n, f in FAMILIES.items() if f.split == s] for s in DRIVES}
    listed = "\n".join(f"- {s}: " + "; ".join(laws[s]) + f". Motions: {', '.join(DRIVES[s])}." for s in DRIVES)
    low, high = RATES[0], RATES[-1]
    travel = f"{TRAVEL[0]:.1%} to {TRAVEL[1]:.0%}"
    relaxation = f"{RELAXATION[0]:g} to {RELAXATION[1]:g}"
    return f"""Made by `python -m benchmarks.law_mismatch --split {split} --keep DIR --out FILE.md`; `--method`
says what is judged, the whole of `mrfit.discover` or the examination by invariances alone.

Specimens are generated here by formulas and integrators of their own. Discovery starts from one of
{", ".join(BASES)}, drawn for each specimen among those that are not of its law's form.

The splits share no seed, no law and no kind of motion; thresholds were set on `development` only.

{listed}

This is `{split}`.

**Law.** Yield force from 50 to 5000 N, four forms of saturation with the current, damping that grows with the field.
A law is odd, timeless and forgets: yield travel {travel} of the half-stroke, relaxation {relaxation} of the time that
the half-stroke takes at full speed. `long-memory` breaks this: yield travel of a quarter to all of the half-stroke, or
relaxation up to 80 ms.

**Tests.** 6 to 20 conditions of three amplitudes and three frequencies, at least 2000 samples each where {SAMPLES} in
all allow it, {low:g} to {high:g} samples a second. Current: constant in each condition, in steps, in sweeps, or
switched within records. Noise of the force white (0.05 to 0.8 % of the range) and coloured, of displacement, current
and temperature white; half of the load cells have an offset. The fluid warms in every record whether or not that
matters.

**Hidden.** {", ".join(LIBRARY)}: 2 to 20 % of the range of the force without it, measured where it is largest (a lag
of the current: 8 to 60 ms, whatever force that makes). The gas spring is hidden only beside bases without a spring of
their own. Outside the library: {", ".join(OUTSIDE)}.

**Real records.** Press (UTFSM), shaking table (labcontrol), NEES and Keio, cut into pieces where there is one record.
Planted: 3, 6 and 12 % of the range; in NEES the current is logged 4, 8 and 16 ms earlier. Development asks bingham,
tanh and boucwen, evaluation biviscous, guo and spencer. Planted end stops and temperatures are listed, not counted.
The truth is what is planted and what the record as it is was said to have of it, also where that was too little for a
name. An earlier current is a dead time of that length.

**Counted.** Right is what names exactly what is hidden, and nothing else. An effect is clear if the root mean square of
its force is that of the force's noise or more. Intervals of shares are Wilson's."""
