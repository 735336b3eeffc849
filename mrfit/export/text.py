"""Text for comments and names of other languages: whatever a file was called, it stays inside its comment."""

import hashlib
import re
import textwrap
from collections.abc import Iterable

from mrfit.io.escapes import visible

LINE_WIDTH = 112
# Of a name in C, which linkers cut after 31 characters: room is left for what follows it
LONGEST_SYMBOL = 24
# What a field must not be called: words of C, its macros here, and of Modelica and MATLAB where fields become variables
RESERVED_WORDS = frozenset(
    "auto break case char const continue default do double else enum extern float for goto if inline int long register "
    "restrict return short signed sizeof static struct switch typedef union unsigned void volatile while K".split()
)

MODELICA_WORDS = frozenset(
    "algorithm and annotation block class connect connector constant der discrete each else elseif elsewhen "
    "encapsulated end enumeration equation expandable extends external false final flow for function if import impure "
    "in initial inner input loop model not operator or outer output package parameter partial protected public pure "
    "record redeclare replaceable return stream then time true type when while within "
    "Boolean Clock Integer Real String".split()
)


def ascii_line(text: str) -> str:
    """Return text on one line of printable ASCII, everything else escaped as ``visible`` does."""
    return visible(text).encode("ascii", "backslashreplace").decode("ascii")


def in_comment(text: str) -> str:
    """Return text that cannot end a C comment, begin one, or join its line with the next."""
    plain = ascii_line(text)
    for sign in ("*/", "/*", "??", "//"):
        plain = plain.replace(sign, " ".join(sign))
    # once more: what was taken apart may have made new ones of three signs
    plain = plain.replace("*/", "* /").replace("/*", "/ *").replace("??", "? ?")
    return plain[:-1] + "(backslash)" if plain.endswith("\\") else plain


def wrapped(lines: Iterable[str]) -> list[str]:
    """Return lines cut to the page's width, what belongs together indented."""
    found = list[str]()
    for line in lines:
        cut = textwrap.wrap(line, LINE_WIDTH, subsequent_indent="    ", break_long_words=True, break_on_hyphens=False)
        found += cut or [""]
    return found


def c_comment(lines: Iterable[str]) -> str:
    """Return a block comment of C."""
    inside = [f" * {in_comment(line)}".rstrip() for line in wrapped(map(in_comment, lines))]
    return "\n".join(["/*", *inside, " */"])


def identifier(text: str, longest: int = LONGEST_SYMBOL) -> str:
    """Return a name that C, MATLAB and Modelica take, of any text."""
    name = re.sub(r"[^A-Za-z0-9]+", "_", text).strip("_") or "fit"
    if len(name) > longest:
        # long names that begin alike stay apart
        name = f"{name[: longest - 5].strip('_')}_{hashlib.sha256(text.encode(errors='replace')).hexdigest()[:4]}"
    name = name if name[0].isalpha() else f"fit_{name}"
    return f"{name}_" if name in RESERVED_WORDS else name


def field(text: str) -> str:
    """Return a parameter's or channel's name as that of a field."""
    name = re.sub(r"[^A-Za-z0-9_]", "_", text) or "_"
    name = name if name[0].isalpha() else f"p_{name}"
    return f"{name}_" if name in RESERVED_WORDS else name


def number(value: float) -> str:
    """Return a number with all its digits, as C, MATLAB and Modelica read it."""
    text = repr(float(value))
    return text if set(text) & set(".en") else f"{text}.0"
