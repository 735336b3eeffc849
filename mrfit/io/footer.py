"""Metadata of a Parquet file, read from its footer without pyarrow, whose import takes longer than a short command.

The footer is a structure in Thrift's compact protocol: fields, each a header byte (step of the field's number, type)
and a value. All but the key-value metadata, field 5, is passed over.
"""

import os
from pathlib import Path

MAGIC = b"PAR1"
KEY_VALUE_METADATA = 5
# Types of the compact protocol; the value of a boolean field is its type
STOP, TRUE, FALSE, BYTE, DOUBLE, BINARY, LIST, SET, MAP, STRUCT = 0, 1, 2, 3, 7, 8, 9, 10, 11, 12
VARINTS = (4, 5, 6)
# Structures within each other; a Parquet footer has fewer than ten
DEEPEST_SCHEMA = 32


def key_value_metadata(path: Path) -> dict[str, str]:
    """Return the texts that were written with a Parquet file, by key.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it is no Parquet file, or its footer is damaged.
    """
    with path.open("rb") as file:
        end = file.seek(0, os.SEEK_END)
        file.seek(max(end - 8, 0))
        tail = file.read(8)
        length = int.from_bytes(tail[:4], "little")
        if tail[4:] != MAGIC or length > end - 8:
            raise ValueError("no Parquet file, or not a whole one")
        file.seek(end - 8 - length)
        footer = _Footer(file.read(length))
    try:
        return footer.metadata()
    except IndexError:
        raise ValueError("its footer is damaged") from None


class _Footer:
    """Reads a structure from its beginning; what ends before its time is an IndexError."""

    def __init__(self, raw: bytes) -> None:
        self.raw, self.at = raw, 0

    def metadata(self) -> dict[str, str]:
        """Return the key-value metadata."""
        found: dict[str, str] = {}
        field = 0
        while head := self._byte():
            field, kind = self._field(field, head)
            if field == KEY_VALUE_METADATA and kind == LIST:
                for _ in range(self._length_and_kind()[0]):
                    key, value = self._pair()
                    found[key] = value
            else:
                self._skip(kind, 0)
        return found

    def _pair(self) -> tuple[str, str]:
        texts, field = {1: "", 2: ""}, 0
        while head := self._byte():
            field, kind = self._field(field, head)
            if kind == BINARY:
                texts[field] = self._binary().decode(errors="replace")
            else:
                self._skip(kind, 0)
        return texts[1], texts[2]

    def _byte(self) -> int:
        self.at += 1
        return self.raw[self.at - 1]

    def _varint(self) -> int:
        value = shift = 0
        while True:
            byte = self._byte()
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return value
            if shift > 63:
                raise ValueError("its footer is damaged")

    def _binary(self) -> bytes:
        begin = self._pass(self._varint())
        return self.raw[begin : self.at]

    def _pass(self, size: int) -> int:
        """Go on by so many bytes; return where they begin."""
        begin = self.at
        self.at += size
        if self.at > len(self.raw):
            raise IndexError
        return begin

    def _field(self, last: int, head: int) -> tuple[int, int]:
        """Return number and type of a field by its header and the number of the last."""
        step, kind = head >> 4, head & 15
        if step:
            return last + step, kind
        written = self._varint()
        # signed numbers alternate: 0, -1, 1, -2 …
        return (written >> 1) ^ -(written & 1), kind

    def _length_and_kind(self) -> tuple[int, int]:
        head = self._byte()
        size = head >> 4
        return (size if size < 15 else self._varint()), head & 15

    def _skip(self, kind: int, depth: int) -> None:
        """Pass over a value."""
        if depth > DEEPEST_SCHEMA:
            raise ValueError("its footer is damaged")
        if kind in VARINTS:
            self._varint()
        elif kind == BINARY:
            self._pass(self._varint())
        elif kind == STRUCT:
            while head := self._byte():
                self._skip_field(head, depth)
        elif kind in (LIST, SET):
            size, element = self._length_and_kind()
            self._skip_elements(size, (element,), depth)
        elif kind == MAP:
            if size := self._varint():
                kinds = self._byte()
                self._skip_elements(size, (kinds >> 4, kinds & 15), depth)
        elif kind in (BYTE, DOUBLE):
            self._pass(1 if kind == BYTE else 8)
        elif kind not in (TRUE, FALSE):
            raise ValueError("its footer is damaged")

    def _skip_field(self, head: int, depth: int) -> None:
        if not head >> 4:
            self._varint()
        self._skip(head & 15, depth + 1)

    def _skip_elements(self, size: int, kinds: tuple[int, ...], depth: int) -> None:
        for _ in range(size):
            for kind in kinds:
                # a boolean that is no field has a byte of its own
                self._skip(BYTE if kind in (TRUE, FALSE) else kind, depth + 1)
