"""XML as exports write it: nodes with attributes, text escaped, a comment at the head."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from xml.sax.saxutils import escape, quoteattr

from mrfit.export.text import ascii_line, wrapped


@dataclass(frozen=True)
class XmlElement:
    """An element: its name, attributes, children and text."""

    name: str
    attributes: Mapping[str, str] = field(default_factory=dict)
    children: Sequence["XmlElement"] = ()
    text: str = ""


def xml(root: XmlElement, head: Iterable[str]) -> bytes:
    """Return a document with a comment at its head."""
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', "<!--"]
    # two hyphens end a comment
    lines += [ascii_line(line).replace("--", "- -").replace("--", "- -").rstrip("-") for line in wrapped(head)]
    lines += ["-->", *_lines(root, 0)]
    return ("\n".join(lines) + "\n").encode("ascii")


def _lines(node: XmlElement, depth: int) -> list[str]:
    indent = "  " * depth
    given = "".join(f" {k}={quoteattr(ascii_line(v))}" for k, v in node.attributes.items())
    if not node.children and not node.text:
        return [f"{indent}<{node.name}{given}/>"]
    if node.text:
        return [f"{indent}<{node.name}{given}>{escape(ascii_line(node.text))}</{node.name}>"]
    inside = [line for child in node.children for line in _lines(child, depth + 1)]
    return [f"{indent}<{node.name}{given}>", *inside, f"{indent}</{node.name}>"]
