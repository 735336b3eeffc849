"""Questions of a decision and their answers, kept in order and read again.

A decision asks a source for one answer after the other; which one comes next depends on the last. ``EvidenceRecorder``
keeps what a source answers, an immutable table. An ``EvidenceReader`` answers from the table alone, so that the
decision can be taken again without a simulation.
"""

from collections.abc import Generator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from typing import Any


@dataclass(frozen=True)
class Answer:
    """A question, the name of a source's method and its arguments, with the answer."""

    question: tuple[Any, ...]
    value: Any


@dataclass(frozen=True)
class Evidence:
    """All that was asked, with the answers.

    Attributes
    ----------
    facts
        Attributes of the source that were read, by name.
    rows
        Questions with their answers, in the order in which they were asked. A fit of the same effects may come to stand
        lower when it is asked for again, so that the order matters.
    """

    facts: Mapping[str, Any]
    rows: tuple[Answer, ...]


class EvidenceRecorder:
    """Source that keeps the answers of another one."""

    def __init__(self, source: Any) -> None:
        self._source, self._facts, self._rows = source, dict[str, Any](), list[Answer]()

    def __getattr__(self, name: str) -> Any:
        found = getattr(self._source, name)
        if callable(found):
            return partial(self._asked, name)
        return self._facts.setdefault(name, found)

    def _asked(self, *question: Any) -> Any:
        name, *arguments = question
        value = getattr(self._source, name)(*arguments)
        self._rows.append(Answer(question, value))
        return value

    def refits(self, wanted: Sequence[Any], labels: Sequence[str] = ()) -> Generator[Any, None, None]:
        """Yield the refits of the source, each with a row of its own."""
        with closing(self._source.refits(wanted, labels)) as answers:
            for one, value in zip(wanted, answers, strict=True):
                self._rows.append(Answer(("refits", one), value))
                yield value

    def evidence(self) -> Evidence:
        """Return the table of all that was asked so far."""
        return Evidence(self._facts, tuple(self._rows))


class EvidenceReader:
    """Source that answers from a table.

    Raises
    ------
    LookupError
        If the table does not hold the next question's answer: it was gathered under other thresholds.
    """

    def __init__(self, evidence: Evidence) -> None:
        self._facts, self._rows = evidence.facts, iter(evidence.rows)

    def __getattr__(self, name: str) -> Any:
        return self._facts[name] if name in self._facts else partial(self._asked, name)

    def _asked(self, *question: Any) -> Any:
        row = next(self._rows, None)
        if row is None or row.question != question:
            raise LookupError(f"the evidence does not answer {question}: gather it under these thresholds")
        return row.value

    def refits(self, wanted: Sequence[Any], labels: Sequence[str] = ()) -> Generator[Any, None, None]:
        """Yield the refits in the next rows."""
        return (self._asked("refits", one) for one in wanted)
