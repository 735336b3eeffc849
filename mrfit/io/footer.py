"""Texts that were written with a Parquet file, read without pyarrow, whose import takes longer than a short command.

The footer holds them in Thrift's compact protocol: key and value one after the other, each as a header byte, its
length in groups of seven bits and its UTF-8. No text that mrfit writes there holds the header byte, a control
character.
"""

import os
import re
from pathlib import Path

MAGIC = b"PAR1"
TEXT_HEADER = b"\x18"


def written_text(path: Path, key: str) -> str | None:
    """Return the text that was written with a Parquet file under a key; None where there is none.

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
        footer = file.read(length)
    word = key.encode()
    name = TEXT_HEADER + bytes([len(word)]) + word + TEXT_HEADER
    found = re.search(re.escape(name) + rb"([\x80-\xff]{0,8}[\x00-\x7f])", footer)
    if not found:
        return None
    size = sum((byte & 0x7F) << 7 * place for place, byte in enumerate(found[1]))
    text = footer[found.end() : found.end() + size]
    if len(text) < size:
        raise ValueError("its footer is damaged")
    return text.decode(errors="replace")
