"""The papers as studies: ``python -m benchmarks.studies --work DIR [NAME …]``, see ``make studies``.

Those of ``make studies-long`` run by ``--long``. Every study makes its logs, runs its pipeline and compares; its
results go to ``benchmarks/studies/results``, and ``docs/studies.md`` is written from all results there are. With
``--checks`` (``make studies-checks``) a study runs on its other rigs and under its checks as well; without, those of
the last such run stay with the rows that agree or differ as before.
"""

import argparse
import importlib
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from time import perf_counter
from types import ModuleType

from benchmarks.studies.page import RESULTS, Study, Table, load, markdown
from benchmarks.studies.runs import ROOT, Place
from datasets.studies.__main__ import NAMES as MADE
from datasets.studies.__main__ import SEED

NAMES = (*MADE, "real")
# By `make studies-long`, and the study whose logs each takes
LONG = {"preyield-long": "preyield", "rotary-vsd-long": "rotary-vsd", "real-long": "real"}
# Those that take longest begin first
LONGEST = ("hammerstein-wiener", "real", "rotary-vsd")
PAGE = ROOT / "docs" / "studies.md"


def main() -> None:
    """Parse the command line, run studies, write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"studies, of {', '.join(NAMES)}; default: all")
    parser.add_argument("--work", type=Path, default=Path("studies-work"), help="folder for logs and workspaces")
    parser.add_argument("--jobs", type=int, default=2, help="studies run side by side; default %(default)s")
    parser.add_argument("--long", action="store_true", help=f"those that take longer: {', '.join(LONG)}")
    parser.add_argument("--checks", action="store_true", help="run them on their other rigs and under their checks too")
    parser.add_argument("--page-only", action="store_true", help="write the page from the results there are")
    options = parser.parse_args()
    if unknown := set(options.names) - {*NAMES, *LONG}:
        parser.error(f"no such study: {', '.join(sorted(unknown))}; there are {', '.join((*NAMES, *LONG))}")
    names = options.names or (list(LONG) if options.long else NAMES)
    if len(names) > 1 and not options.page_only:
        side_by_side(names, options.work, options.jobs, ["--checks"] * options.checks)
    elif not options.page_only:
        began = perf_counter()
        run(names[0], options.work.resolve(), options.checks)
        print(f"{names[0]}: {perf_counter() - began:.0f} s", flush=True)
    PAGE.write_text(page(), encoding="utf-8")
    print(PAGE)


def side_by_side(names: Sequence[str], work: Path, jobs: int, more: Sequence[str] = ()) -> None:
    """Run studies in processes of their own, the longest first.

    Raises
    ------
    subprocess.CalledProcessError
        If one of them fails.
    """
    command = [sys.executable, "-m", "benchmarks.studies", "--work", str(work), *more]
    ordered = sorted(names, key=lambda name: LONGEST.index(name) if name in LONGEST else len(LONGEST))
    with ThreadPoolExecutor(jobs) as pool:
        running = [pool.submit(subprocess.run, [*command, name], check=True) for name in ordered]
        for one in running:
            one.result()


def run(name: str, work: Path, again: bool = False) -> None:
    """Run one study: logs, pipeline, comparison, results; again on its other rigs and under its checks if asked for."""
    place = Place(work / "logs" / LONG.get(name, name), work / name)
    module = importlib.import_module(f"benchmarks.studies.{name.replace('-', '_')}")
    if place.logs.name in MADE:
        made(place)
    study: Study | None = module.run(place.logs, place.work)
    if study is None:
        print(f"{name}: skipped, MRFIT_REAL_LOGS names no folder of real logs", file=sys.stderr)
        return
    if not again:
        before = RESULTS / f"{name}.json"
        (study.with_outcomes_of(load(name)) if before.is_file() else study).save()
        return
    rigs, checks = (
        {words: tables_of(module, place, f"{key}{k}", change) for k, (words, change) in enumerate(changes.items(), 1)}
        for key, changes in (("rig", getattr(module, "RIGS", {})), ("check", getattr(module, "CHECKS", {})))
    )
    study.beside(rigs, checks).save()


def tables_of(module: ModuleType, place: Place, key: str, change: object) -> list[Table]:
    """Return the tables of a study under a change: a function of the study, or another rig that it is run on."""
    if callable(change):
        return list(change(place))
    logs, work = (path.with_name(f"{path.name}-{key}") for path in (place.logs, place.work))
    other = Place(logs, work, change)
    made(other, place.logs.name, change)
    return list(module.core(other))


def made(place: Place, name: str = "", *rig: object) -> None:
    """Make the logs of a study, by its own rig or by another."""
    place.logs.mkdir(parents=True, exist_ok=True)
    importlib.import_module(f"datasets.studies.{(name or place.logs.name).replace('-', '_')}").make(
        place.logs, SEED, *rig
    )


def page() -> str:
    """Return the page of all results there are."""
    return markdown([load(name) for name in (*NAMES, *LONG) if (RESULTS / f"{name}.json").is_file()])


if __name__ == "__main__":
    main()
