"""Every command line that users are shown: of pages, help and messages, with what each one needs to be run.

``python -m tests.docs.command_lines`` prints how many there are. What to write for their placeholders, which take
long, and which are not run and why, stands in ``command_lines.toml``.
"""

import ast
import fnmatch
import re
import shlex
import tomllib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import mrfit
from docs.reference import commands as reference
from tests.conftest import ROOT
from tests.docs.pages import PAGES, commands

PACKAGE = Path(mrfit.__path__[0])
KNOWN = reference.commands()
GROUPS = {name for name in KNOWN if any(other.startswith(f"{name} ") for other in KNOWN)}
RULES = tomllib.loads((Path(__file__).parent / "command_lines.toml").read_text(encoding="utf-8"))


@dataclass(frozen=True)
class CommandLine:
    """A command line as it is run.

    Attributes
    ----------
    text
        What is run, after ``mrfit``; placeholders have been filled in.
    kind
        ``quick``, ``slow``, ``excused`` or, where it lacks what the command needs, ``mention``.
    lab
        Folder in which it is run.
    reason
        Why an excused one is not run.
    places
        Files that show it.
    """

    text: str
    kind: str
    lab: str
    reason: str
    places: tuple[str, ...]


@cache
def command_lines() -> tuple[CommandLine, ...]:
    """Return all different command lines, in the order of their texts."""
    places: dict[str, set[str]] = {}
    for written, place in shown():
        places.setdefault(filled(written), set()).add(place)
    return tuple(_ruled(text, tuple(sorted(places[text]))) for text in sorted(places))


@cache
def shown() -> tuple[tuple[str, str], ...]:
    """Return every command line as it is written, without ``mrfit``, and the file that shows it."""
    return tuple(_shown())


def _shown() -> Iterator[tuple[str, str]]:
    for page in PAGES:
        for words in commands(page):
            yield shlex.join(words), str(page.relative_to(ROOT))
    for name, command in KNOWN.items():
        for text in (command.help or "", *(getattr(p, "help", "") or "" for p in command.params)):
            for found in written_in(" ".join(text.split())):
                yield found, f"{name} --help"
    for path in sorted(PACKAGE.rglob("*.py")):
        source = path.read_text(encoding="utf-8")
        # most modules show no command: to parse them takes every worker of the tests 2 s
        for text in messages(ast.parse(source)) if re.search("mrfit[ '\"]", source) else ():
            for found in written_in(text):
                yield found, str(path.relative_to(ROOT))


def written_in(text: str) -> list[str]:
    """Return the command lines in a message or help text: between backticks, or up to the end of the text."""
    quoted = re.findall(r"(?<!`)`mrfit ([^`]+)`(?!`)", text)
    plain = re.findall(r"(?:^|: )mrfit ([a-z][^`;]*)", re.sub(r"`[^`]*`", "", text))
    return [one.strip() for one in (*quoted, *plain) if f"mrfit {one.split()[0]}" in KNOWN]


def messages(tree: ast.Module) -> Iterator[str]:
    """Yield the texts of a module but its docstrings; what is put into them stands between braces."""
    nodes = list(ast.walk(tree))
    inner = {id(part) for node in nodes if isinstance(node, ast.JoinedStr) for part in node.values}
    inner |= {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
    for node in nodes:
        if id(node) in inner:
            continue
        if isinstance(node, ast.JoinedStr):
            parts = (p.value if isinstance(p, ast.Constant) else f"{{{_inserted(p)}}}" for p in node.values)
            yield "".join(map(str, parts))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value


def _inserted(part: ast.expr) -> str:
    return ast.unparse(part.value) if isinstance(part, ast.FormattedValue) else ""


def filled(written: str) -> str:
    """Return a command line with values for its placeholders."""
    for place, value in RULES["values"].items():
        if re.fullmatch(r"[\w.…]+", place):
            written = re.sub(rf"(?<![\w'./-]){re.escape(place)}(?![\w./-])", value, written)
        else:
            written = written.replace(place, value)
    return re.sub(" --work mrfit-work$", "", written)


def _ruled(text: str, places: tuple[str, ...]) -> CommandLine:
    rule: dict[str, Any] = next((r for r in RULES["lines"] if fnmatch.fnmatchcase(text, r["like"])), {})
    lab = rule.get("lab", "coil" if re.search(r"coil|boucwen-flux|flux", text) else "damper")
    kind = "excused" if "reason" in rule else "slow" if rule.get("slow") else "quick"
    if lacks(shlex.split(text)) and "reason" not in rule:
        kind = "mention"
    return CommandLine(text, kind, lab, rule.get("reason", ""), places)


def lacks(words: list[str]) -> list[str]:
    """Return what a command needs and a line does not give, as `mrfit fit` in a sentence that speaks of it."""
    name, rest = "mrfit", words
    while rest and f"{name} {rest[0]}" in KNOWN:
        name, rest = f"{name} {rest[0]}", rest[1:]
    if "--help" in rest:
        return []
    if name in GROUPS:
        return ["a command"] if not rest else []
    options = {o: p for p in KNOWN[name].params for o in p.opts if o.startswith("-")}
    given, place = set[str](), 0
    while place < len(rest):
        option, equals, _ = rest[place].partition("=")
        if option in options:
            given.add(options[option].name)
            place += 0 if options[option].is_flag or equals else 1
        else:
            given.add("argument")
        place += 1
    needed = [p for p in KNOWN[name].params if p.required]
    return [p.name for p in needed if ("argument" if p.param_type_name == "argument" else p.name) not in given]


def counted() -> str:
    """Return how many command lines there are of each kind, in one sentence."""
    lines = command_lines()
    of = Counter(one.kind for one in lines)
    return (
        f"{len(lines)} command lines on pages, in help and in messages: {of['quick']} run by `make test`, {of['slow']} "
        f"more by `make docs`, {of['excused']} not run, for reasons given; {of['mention']} only speak of a command."
    )


if __name__ == "__main__":
    print(counted())
