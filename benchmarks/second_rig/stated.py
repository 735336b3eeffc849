"""Compare the error of a base that a discovery states with that of `mrfit fit`, on cases of the second rig.

`python -m benchmarks.second_rig.stated FOLDER --every 3`, FOLDER as `python -m benchmarks.second_rig --keep` left it.
"""

import json
from argparse import ArgumentParser
from collections import Counter
from pathlib import Path
from shutil import copytree, ignore_patterns
from tempfile import TemporaryDirectory

from mrfit.fit.stage import over_held_out
from mrfit.io.schemas.fit import Fit
from mrfit.io.schemas.reading import parsed

from .__main__ import MOST_PROCESSOR_TIME, run_command

FOUND, FITTED = Path("discover", "discovery.json"), Path("fits", "stated", "fit.json")


def compared(case: Path) -> str:
    """Return how the plain error of a case's base compares with that of its fit, in a word and both numbers."""
    found = json.loads((case / "work" / FOUND).read_text())
    stated = found["gap"].get("plain_before")
    with TemporaryDirectory() as folder:
        work = Path(folder) / "work"
        copytree(case / "work", work, ignore=ignore_patterns("discover", "fits"))
        asked = ["fit", "--model", found["base_model"], "--per", "all", "--name", "stated", "--work", str(work)]
        code, _ = run_command(asked, Path(folder) / "said.txt", MOST_PROCESSOR_TIME)
        if code:
            return "fit failed" if stated is None else f"fit failed, {stated} stated"
        own = over_held_out(parsed(FITTED, (work / FITTED).read_text(), Fit, "").metrics)
    if stated is None:
        is_left_out = any("plain errors" in part for part in found.get("left_out", ()))
        return "left out" if is_left_out else f"none stated, fit {own}"
    return "equal" if stated == own else f"differs: {stated} stated, fit {own}"


def main() -> None:
    """Print how many are equal, and each that is not."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="kept cases")
    parser.add_argument("--every", type=int, default=1, help="only each N-th case")
    given = parser.parse_args()
    counts: Counter[str] = Counter()
    cases = [case for case in sorted(given.folder.iterdir()) if (case / "work" / FOUND).exists()]
    for case in cases[:: given.every]:
        said = compared(case)
        counts[said.partition(":")[0].partition(",")[0]] += 1
        if said not in ("equal", "left out"):
            print(f"{case.name}: {said}", flush=True)
    print(", ".join(f"{word} {count}" for word, count in counts.items()))


if __name__ == "__main__":
    main()
