"""What an item may define is said in one place, and mrfit's own items are what is said there."""

import inspect
import re
from pathlib import Path

import pytest

import mrfit
from mrfit.core import protocols, registry
from mrfit.core.built_in import KINDS, own_names
from mrfit.core.protocols import Effect, Model, Optimizer, Reader, kind_of, required

PACKAGE = Path(mrfit.__path__[0])
FIRST = {"model": Model, "effect": Effect, "optimizer": Optimizer, "reader": Reader}


@pytest.mark.parametrize("kind", KINDS)
def test_mrfits_own_items_are_what_their_kind_must_be(kind: str) -> None:
    for name in own_names(kind):
        item = registry.load(kind, name)
        assert isinstance(item, FIRST[kind]), name
        assert kind_of(item.SPEC) == kind
        assert [f for f in required(item.SPEC) if not callable(getattr(item, f))] == []


def test_nothing_is_no_spec() -> None:
    assert kind_of(None) is None and required(object()) == ()


def test_no_attribute_of_an_item_is_looked_for_past_the_protocols() -> None:
    looked = re.compile(r"\b(?:getattr|hasattr)\((?:module|effect|reader|model|optimizer)\b")
    found = [p.relative_to(PACKAGE).as_posix() for p in sorted(PACKAGE.rglob("*.py")) if looked.search(p.read_text())]
    assert set(found) <= {"contracts/effects.py", "contracts/readers.py"}


def test_every_function_of_a_protocol_says_what_it_returns_or_does() -> None:
    kinds = [k for _, k in inspect.getmembers(protocols, inspect.isclass) if k.__module__ == protocols.__name__]
    functions = [f for k in kinds for n, f in vars(k).items() if inspect.isfunction(f) and not n.startswith("_")]
    assert len(kinds) >= 19 and len(functions) >= 19
    assert [k.__name__ for k in (*kinds, *functions) if not (k.__doc__ or "").strip()] == []
