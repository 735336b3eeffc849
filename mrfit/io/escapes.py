"""Text that others wrote, as names and headers, made harmless: shown as it is, obeyed by nothing, fit for any file."""

import re

# What a terminal may obey (C0 and C1 controls), and what makes text read otherwise than it stands (bidirectional and
# invisible characters, line separators, halves of characters)
_OBEYED = re.compile("[\x00-\x1f\x7f-\x9f\u200b\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff\ud800-\udfff]")
# The same but what JSON escapes by itself
_OBEYED_IN_JSON = re.compile("[\x7f-\x9f\u200b\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff]")
# The same but what ends lines and indents them
_OBEYED_IN_PAGE = re.compile(r"(?![\t\n\r])" + _OBEYED.pattern)
_SHORT = {"\n": r"\n", "\r": r"\r", "\t": r"\t"}


def encodable(text: str) -> str:
    r"""Return text that UTF-8 can hold: bytes of a file's name that are no text become ``\xe9``.

    Python keeps such bytes as halves of characters; where the locale is not UTF-8, all but ASCII are kept so.
    """
    if text.isascii():
        return text
    try:
        return text.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")
    except UnicodeEncodeError:
        return text.encode("utf-8", "backslashreplace").decode("utf-8")


def visible(text: str) -> str:
    r"""Return text for a terminal, on one line: control characters are shown, as in ``\x1b[31m``."""
    return _OBEYED.sub(lambda m: _SHORT.get(m[0]) or _escaped(m[0]), encodable(text))


def visible_in_page(text: str) -> str:
    r"""Return a page or a drawing for a file: its lines as they are, control characters in them shown."""
    return _OBEYED_IN_PAGE.sub(lambda m: _escaped(m[0]), encodable(text))


def visible_json(text: str) -> str:
    """Return JSON for a terminal: the same content, with control characters escaped."""
    return _OBEYED_IN_JSON.sub(lambda m: f"\\u{ord(m[0]):04x}", text)


def _escaped(character: str) -> str:
    code = ord(character)
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}"
