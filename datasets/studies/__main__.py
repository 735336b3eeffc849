"""Make the logs of the studies: ``python -m datasets.studies --out DIR [NAME …] [--seed N]``.

One set of logs for each of the five papers, by a rig built to the paper's set-up: its conditions, sampling, sensors and
noise. The same seed gives the same bytes. They are not committed; ``make studies`` makes them.
"""

import argparse
import importlib
from pathlib import Path

NAMES = ("coil-flux", "preyield", "force-tracking", "rotary-vsd", "hammerstein-wiener")
SEED = 20260


def main() -> None:
    """Parse the command line and write the logs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"studies, of {', '.join(NAMES)}; default: all")
    parser.add_argument("--out", type=Path, required=True, help="folder to write under, a folder a study")
    parser.add_argument("--seed", type=int, default=SEED, help="any whole number; default %(default)s")
    options = parser.parse_args()
    if unknown := set(options.names) - set(NAMES):
        parser.error(f"no such study: {', '.join(sorted(unknown))}; there are {', '.join(NAMES)}")
    for name in options.names or NAMES:
        folder = options.out / name
        folder.mkdir(parents=True, exist_ok=True)
        importlib.import_module(f"datasets.studies.{name.replace('-', '_')}").make(folder, options.seed)


if __name__ == "__main__":
    main()
