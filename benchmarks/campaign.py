"""A campaign of cases by kind: its options, its results as lines of JSON, and where it goes on."""

import json
import shutil
import tempfile
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any


def campaign_parser(description: str | None, kinds: Sequence[str], choices: Sequence[str]) -> ArgumentParser:
    """Return a parser of a campaign's options; ``choices`` are what ``--kinds`` takes, ``kinds`` what it is without."""
    parser = ArgumentParser(description=description)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--cases", type=int, default=len(kinds), help="spread evenly over the kinds")
    parser.add_argument("--first", type=int, default=0, help="index of the first case of each kind")
    parser.add_argument("--kinds", nargs="+", choices=choices, default=list(kinds))
    parser.add_argument("--out", type=Path, required=True, help="results, one line of JSON a case")
    parser.add_argument("--resume", action="store_true", help="leave out the cases that are in the results")
    parser.add_argument("--keep", type=Path, help="keep logs, truth and workspace of each case in this folder")
    parser.add_argument("--only-table", action="store_true", help="print the tables of the results that are there")
    return parser


def earlier_rows(parser: ArgumentParser, given: Namespace) -> list[dict[str, Any]]:
    """Return the results that are there, if they are to be continued or shown; else a parser's error."""
    if not given.out.exists():
        return []
    if not (given.resume or given.only_table):
        parser.error(f"{given.out} exists: continue it with --resume or name another file")
    return [json.loads(line) for line in given.out.read_text().splitlines()]


def cases_left(
    given: Namespace, kinds: Sequence[str], rows: Sequence[dict[str, Any]]
) -> Iterator[tuple[str, int, str]]:
    """Yield kind, index and name of each case that is not among the results."""
    done = {row["case"] for row in rows}
    for number in range(0 if given.only_table else given.cases):
        kind, index = kinds[number % len(kinds)], given.first + number // len(kinds)
        case = f"seed{given.seed}-{kind}-{index:03d}"
        if case not in done:
            yield kind, index, case


def case_folder(given: Namespace, case: str) -> AbstractContextManager[Any]:
    """Return an empty folder for a case, which is left where it is to be kept."""
    if not given.keep:
        return tempfile.TemporaryDirectory()
    shutil.rmtree(given.keep / case, ignore_errors=True)
    return nullcontext(given.keep / case)


def store_row(given: Namespace, row: dict[str, Any]) -> None:
    """Write the result of a case behind those that are there."""
    with given.out.open("a") as file:
        file.write(json.dumps(row) + "\n")
