"""Output for a person at the terminal: progress bars on standard error, tables and summaries on standard output."""

import gc
import io
import json
import os
import signal
import sys
import textwrap
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from typing import Any, NoReturn, TextIO

import typer

from mrfit.core.progress import Progress, on_compilation, silent
from mrfit.errors import MrfitError
from mrfit.io.bars import terminal_bars
from mrfit.io.escapes import visible, visible_json
from mrfit.io.memory import on_need


@dataclass
class Verbosity:
    """Amount and form of a command's output.

    Attributes
    ----------
    quiet
        One line on standard output.
    verbose
        On standard error also every step with its time.
    as_json
        One JSON document on standard output.
    last, concluded
        The last line that was left out, and whether the one line was printed.
    """

    quiet: bool = False
    verbose: bool = False
    as_json: bool = False
    last: str = ""
    concluded: bool = False


VERBOSITY = Verbosity()

# Exit code of a command that Ctrl-C ended, which typer gives of itself
INTERRUPTED = 130
# Objects made, less those gone, after which those in cycles are collected; Python's own default is 700
COLLECTED_AT = 50_000
# Columns of a terminal below which tables have no frame, whose room their names need
NARROW_COLUMNS = 100
# Columns of tables that go to a file or another program, where MRFIT_COLUMNS does not say
WIDE_COLUMNS = 150
# Characters of a column of text whose cells are folded, and of a column's name that is not broken at its underscores
FOLDED_COLUMN, SHORT_WORD = 10, 8


def print_json(summary: object) -> None:
    """Print a machine-readable summary, alone, to standard output."""
    from mrfit.io.schemas.reading import Document
    from mrfit.io.workspace import plain, to_json

    content = to_json(summary) if isinstance(summary, Document) else plain(summary)
    sys.stdout.write(visible_json(json.dumps(content, indent=2, ensure_ascii=False)) + "\n")


def note(text: str) -> None:
    """Print a line for a person to standard error."""
    from rich.console import Console

    Console(stderr=True, highlight=False, emoji=False).print(visible(text), markup=False, soft_wrap=True)


_note_once = cache(note)


def _note_compilation(what: str, done: int, total: int) -> None:
    """Print once that kernels are compiled, before which a command may show nothing for a minute."""
    if done < total and not VERBOSITY.quiet:
        _note_once(what)


def say(text: str) -> None:
    """Print a line of a command's answer to standard output, unless only its summary is wanted."""
    if VERBOSITY.quiet:
        VERBOSITY.last = text.strip()
    else:
        _print(text)


def say_each(lines: Iterable[str], before: str = "  ") -> None:
    """Print lines of a command's answer, all with the same before them."""
    for line in lines:
        say(f"{before}{line}")


def outdated_line(reason: str, again: str = "") -> str:
    """Return the warning of a result that is out of date; ``again`` makes it right, of a fit what ``remedy`` says."""
    from mrfit.io.outdated import remedy

    return f"warning outdated: {reason}: {again or remedy(reason)}"


def conclude(text: str) -> None:
    """Print the summary of a command in one line, also where nothing else is wanted."""
    VERBOSITY.concluded = True
    _print(text)


def finish() -> None:
    """Print the last line of a quiet command that has no summary of its own."""
    if VERBOSITY.quiet and VERBOSITY.last and not VERBOSITY.concluded:
        _print(VERBOSITY.last)


def _print(text: str) -> None:
    from rich.console import Console

    Console(highlight=False, emoji=False).print(visible(text), markup=False, soft_wrap=True)


class WrittenNumber(str):
    """A number as it stands in a table."""


def print_table(title: str, columns: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Print a table to standard output; numbers are right-aligned and shown with four significant digits.

    What has no room beside the first column goes on below, beside the first column again.
    """
    if VERBOSITY.quiet:
        return
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    # not COLUMNS: readline sets it for every process that a Python shell starts
    width = os.environ.get("MRFIT_COLUMNS", "")
    console = Console(width=None if sys.stdout.isatty() else int(width) if width.isdecimal() else WIDE_COLUMNS)
    narrow, between = console.width < NARROW_COLUMNS, 2 if console.width < NARROW_COLUMNS else 3
    texts = [[cell(row[k]) for row in rows] for k in range(len(columns))]
    wide = sum(max(map(len, [name, *text])) + between for name, text in zip(columns, texts, strict=True))
    crowded = narrow or wide >= console.width
    headings = [_broken(n, text) if crowded else [n] for n, text in zip(columns, texts, strict=True)]
    widths = [max(map(len, [*heading, *text])) for heading, text in zip(headings, texts, strict=True)]
    # a number that is broken over two lines reads as two
    numeric = [
        any(isinstance(r[k], (int, float, WrittenNumber)) and not isinstance(r[k], bool) for r in rows)
        for k in range(len(columns))
    ]
    # as a name that is typed or copied, where the rest has room
    whole = [numeric[0] or (crowded and widths[0] <= console.width // 3), *numeric[1:]]
    least = [between + (w if one else min(w, FOLDED_COLUMN)) for w, one in zip(widths, whole, strict=True)]
    console.print(Text(visible(title), "italic"), soft_wrap=True)
    for part in _tables_below(least, console.width):
        table = Table(header_style="bold")
        if narrow:
            table.box, table.padding, table.show_edge, table.pad_edge = box.SIMPLE_HEAD, (0, 1, 0, 0), False, False
        for k in part:
            heading = Text("\n".join(map(visible, headings[k])))
            table.add_column(heading, justify="right" if numeric[k] else "left", overflow="fold", no_wrap=whole[k])
        for n in range(len(rows)):
            table.add_row(*[Text(visible(texts[k][n])) for k in part])
        console.print(table)


def _tables_below(least: Sequence[int], room: int) -> list[list[int]]:
    """Return the columns of tables one below the other, each with the first, by the least width of every column."""
    parts: list[list[int]] = [[0]]
    for k in range(1, len(least)):
        if len(parts[-1]) > 1 and sum(least[j] for j in [*parts[-1], k]) >= room:
            parts.append([0])
        parts[-1].append(k)
    return parts


def _broken(name: str, cells: Sequence[str]) -> list[str]:
    """Return a column's name in lines that are no wider than its cells, or than its longest word."""
    room = max(SHORT_WORD, *map(len, [*cells, ""]))
    words = " ".join(w if len(w) <= room else w.replace("_", " ") for w in name.split()).split()
    return textwrap.wrap(" ".join(words), max(map(len, [*cells, *words, " "])))


def cell(value: object) -> str:
    """Return a value as it stands in a table."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return "–" if value != value else f"{value:.4g}"
    return str(value)


@contextmanager
def progress_bar() -> Iterator[Progress]:
    """Give a progress listener that draws one bar for each task on standard error, where that is a terminal.

    Elsewhere it prints a line with an estimate of what takes longer than 10 s, and one every 10 s.
    """
    if VERBOSITY.verbose:
        yield _Steps()
    elif VERBOSITY.quiet:
        yield silent
    elif not sys.stderr.isatty():
        yield Lines()
    else:
        with terminal_bars() as listen:
            yield listen


class Lines:
    """A progress listener for pipes: an estimate first of what takes longer than ``EVERY`` s, and a line every so many.

    A search may end before its last evaluation, so that the estimate is the most that is left.

    Attributes
    ----------
    clock
        Returns the time in s.
    """

    EVERY, FIRST = 10.0, 1.0

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self.clock = clock
        self.started: dict[str, float] = {}
        self.due: dict[str, float] = {}

    def __call__(self, what: str, done: int, total: int) -> None:
        """Report the progress of a task, if it is time to."""
        task, now = what.split("  ")[0], self.clock()
        start = self.started.setdefault(task, now)
        spent = now - start
        whole = spent * total / max(done, 1)
        if task not in self.due:
            if spent >= self.FIRST and whole > self.EVERY and done < total:
                note(f"{task}: up to {whole:.0f} s")
                self.due[task] = start + self.EVERY
        elif now >= self.due[task] and done < total:
            note(f"{task}: {done} of {total}, up to {whole - spent:.0f} s left")
            self.due[task] = now + self.EVERY
        if done >= total:
            self.started.pop(task, None)
            self.due.pop(task, None)


class _Steps:
    """A progress listener that prints a line at the end of every task, with the time it took."""

    def __init__(self) -> None:
        self.started: dict[str, float] = {}

    def __call__(self, what: str, done: int, total: int) -> None:
        task = what.split("  ")[0]
        started = self.started.setdefault(task, time.monotonic())
        if done >= total:
            note(f"{task}: {total} in {time.monotonic() - self.started.pop(task, started):.1f} s")


def numbers(row: Mapping[str, Any], names: Sequence[str]) -> list[Any]:
    """Pick values of a row in the order of ``names``."""
    return [row.get(n) for n in names]


def run(app: typer.Typer) -> NoReturn:
    """Run the command line; every error ends in one line and the right exit code, a traceback with --debug only."""
    # a start makes a hundred thousand objects that stay, through which the collector would go again and again
    gc.set_threshold(COLLECTED_AT)
    # asked to end, end as at Ctrl-C: workers too, and the terminal as it was
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    on_need(note)
    # a closed stream is None, to which nothing can be written
    sys.stdout, sys.stderr = sys.stdout or _nowhere(), sys.stderr or _nowhere()
    for stream in (sys.stdout, sys.stderr):
        # whatever the locale: the answers hold units and signs that ASCII has not
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(encoding="utf-8", errors="backslashreplace")
    try:
        with on_compilation(_note_compilation):
            code = app(standalone_mode=False) or 0
    except KeyboardInterrupt:
        code = INTERRUPTED
    except Exception as error:
        text, code = explain(error)
        if "--debug" in sys.argv and not _of_usage(error) and code != INTERRUPTED:
            # a message of several lines must not look like mrfit's own
            sys.stderr.writelines(f"  {visible(line)}\n" for line in traceback.format_exc().splitlines())
        sys.stderr.write(f"mrfit: {visible(text)}\n" if text else "")
        if text and "--json" in sys.argv:
            print_json({"error": {"kind": _kind(error), "message": text, "exit_code": code}})
    if code == INTERRUPTED:
        sys.stderr.write("mrfit: stopped; the same command goes on where this one was\n")
    sys.exit(code)


def _nowhere() -> TextIO:
    return open(os.devnull, "w", encoding="utf-8")


def _kind(error: Exception) -> str:
    """Return the kind of an error for a program: what is wrong are the data, the command line or settings, or mrfit."""
    if _of_usage(error):
        return "config"
    kinds = {"ConfigError": "config", "MrfitError": "data", "OSError": "system", "MemoryError": "system"}
    return next((kinds[c.__name__] for c in type(error).__mro__ if c.__name__ in kinds), "internal")


def _of_usage(error: Exception) -> bool:
    # typer brings a click of its own, whose usage errors have no public name
    return hasattr(error, "format_message")


def _interrupted(error: BaseException | None) -> bool:
    """Return whether an error is what compiled code makes of an interrupt: a SystemError, or a chain of them."""
    while isinstance(error, SystemError):
        error = error.__cause__
    return isinstance(error, KeyboardInterrupt)


def _commands_like(word: str, root: Any) -> list[str]:
    """Return the commands below a root, those of its groups included, that a word names or begins."""
    found = []
    for name, one in getattr(root, "commands", {}).items():
        inner = getattr(one, "commands", None)
        own = [(f"{name} {n}", n) for n in inner] if inner else [(name, name)]
        found += [f"`mrfit {path}`" for path, last in own if last == word or last.startswith(f"{word}-")]
    return found


def explain(error: Exception) -> tuple[str, int]:
    """Return the one line and the exit code with which an exception ends."""
    if isinstance(error, MrfitError):
        return str(error), error.exit_code
    if isinstance(error, typer.Abort) or _interrupted(error):
        return "", INTERRUPTED
    if _of_usage(error):
        context = getattr(error, "ctx", None)
        path = context.command_path if context else "mrfit"
        text = str(error.format_message())  # type: ignore[attr-defined]
        start, word, *_ = (*text.split("'"), "")
        if context and start == "No such command " and (known := _commands_like(word, context.find_root().command)):
            text = f"{start}'{word}': it may be {' or '.join(known)}"
        if "No such option: --debug" in text:
            return "--debug stands before the command, as in `mrfit --debug fit …`", 2
        # without arguments help was printed already
        return f"{text} (`{path} --help` shows how)" if text else "", 2
    if isinstance(error, (MemoryError, OSError)):
        return f"{error}", 1
    from mrfit.core import plugins

    if told := plugins.said_by_compiler(error):
        return told, 1
    if place := plugins.place_of(error):
        return f"{place}: {type(error).__name__}: {error}; mend the plug-in (--debug shows more)", 1
    return f"unexpected {type(error).__name__}: {error} (--debug shows where)", 1
