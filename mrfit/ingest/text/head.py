"""The first 64 KiB of a file: its encoding and lines, by which readers know their own."""

import codecs
import gzip
import html
import io
import mmap
import re
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrfit.core.channels import CHANNELS
from mrfit.ingest.refusal import Refusal

Text = bytes | mmap.mmap
HEAD_BYTES = 65536
TAIL_BYTES = 16384
"""Bytes at the end of a file by which its last lines and numbers are judged."""
TEXT_CHUNK = 1 << 20
FEED, RETURN = 10, 13
SINGLE_BYTE = ["cp1252", "latin_1", "cp437", "cp850", "mac_roman"]
OTHER_LETTERS, CYRILLIC = ("gb18030", "shift_jis", "euc_kr", "cp1251"), "\u0400"
"""Encodings of Chinese, Japanese, Korean and Russian programs, and the first of their letters."""
GZIP, MOST_UNPACKED = b"\x1f\x8b", 1 << 26
"""How a gzip archive begins, and the most bytes of a file that is rewritten in memory before it is read."""
WIDE_MARKS = (codecs.BOM_UTF32_LE, codecs.BOM_UTF32_BE)
HTML_PAGE = re.compile(rb"\s*<(?:!doctype html|html|table|meta|head)\b", re.IGNORECASE)
"""How a page begins, as a program saves a table and calls it a spreadsheet."""
HTML_CELL = re.compile(rb"<t[dh]\b", re.IGNORECASE)
HTML_MARKS = (
    (r"[\r\n\t]+", " "),
    (r"(?i)<(?:tr|/table)\b[^<>]*>", "\n"),
    # a cell ends where the next one begins: the tag that ends it may be left out
    (r"(?i)<t[dh]\b[^<>]*>", "\t"),
    (r"<[^<>]*>", ""),
)
"""Marks of a table in a page and what stands for them in text."""
CONTAINERS = (
    (b"PK\x03\x04", "a ZIP, XLSX or ODS file", "export the sheet as CSV, or unpack the archive"),
    (b"\xd0\xcf\x11\xe0", "an old Excel file", "export the sheet as CSV"),
    (GZIP, "a gzip archive", "unpack it first"),
    (b"%PDF", "a PDF", "ingest the log itself"),
    (b"\x89PNG", "a picture", "ingest the log itself"),
)


@dataclass(frozen=True, slots=True)
class Head:
    """The beginning of a file.

    Attributes
    ----------
    path
        The file.
    size
        Its length in bytes.
    raw
        Its first 64 KiB.
    encoding
        Text encoding, or the empty string of a binary file.
    lines
        Complete decoded lines of ``raw``; empty for a binary file.
    unpacked
        Its text, where it is another file's content: of an archive, or of a table in a page; its size and ``raw`` are
        those of the text.
    """

    path: Path
    size: int
    raw: bytes
    encoding: str
    lines: tuple[str, ...]
    unpacked: bytes | None = None

    @property
    def body_encoding(self) -> str:
        """Encoding of the text as ``body_bytes`` gives it."""
        return "utf-8" if self.encoding.startswith("utf-16") else self.encoding

    def starts(self, *prefixes: str) -> bool:
        """Whether the first line that is not blank begins with one of ``prefixes``, whatever their case."""
        first = next((line.strip() for line in self.lines if line.strip()), "").lower()
        return first.startswith(tuple(p.lower() for p in prefixes))


def open_head(path: Path) -> Head:
    """Return the beginning of a file, or of the text in it.

    Raises
    ------
    Refusal
        If there is no such file, it cannot be opened, or it holds no data at all.
    """
    try:
        with path.open("rb") as handle:
            raw = handle.read(HEAD_BYTES)
        size = path.stat().st_size
    except FileNotFoundError:
        raise Refusal(path, "no such file", "check the path and its spelling") from None
    except OSError as error:
        raise Refusal(path, f"cannot be opened ({error.strerror or error})", "check its permissions") from None
    unpacked = _unpacked(path, raw)
    if unpacked is not None:
        raw, size = unpacked[:HEAD_BYTES], len(unpacked)
    _check_content(path, raw)
    encoding = encoding_of(raw)
    text = decode(raw, encoding) if encoding else ""
    lines = text.replace("\0", "").split("\n")  # of the body, lines with a NUL byte are refused
    if size > len(raw) and len(lines) > 1:
        lines.pop()  # cut off at 64 KiB
    return Head(path, size, raw, encoding, tuple(lines) if encoding else (), unpacked)


def _unpacked(path: Path, raw: bytes) -> bytes | None:
    """Return the text in an archive or a page, or of letters of four bytes; None of another file.

    Raises
    ------
    Refusal
        If it is too long, or an archive is damaged or holds no text.
    """
    page = HTML_PAGE.match(raw) and HTML_CELL.search(raw)
    if not (page or raw.startswith((GZIP, *WIDE_MARKS))):
        return None
    try:
        with gzip.open(path) if raw.startswith(GZIP) else path.open("rb") as handle:
            data = handle.read(MOST_UNPACKED + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise Refusal(path, f"a gzip archive that is damaged ({error})", "copy it again") from None
    if len(data) > MOST_UNPACKED:
        raise Refusal(path, f"it holds more than {MOST_UNPACKED >> 20} MiB of text", "write its rows as plain text")
    if raw.startswith(GZIP):
        if not encoding_of(data[:HEAD_BYTES]) or data.startswith(tuple(magic for magic, _, _ in CONTAINERS)):
            raise Refusal(path, "a gzip archive, which holds no text", "unpack it first")
        return data
    text = data.decode("utf-32" if not page else encoding_of(raw) or "utf-8", errors="replace")
    return (_table_of_page(text) if page else text).encode()


def _table_of_page(text: str) -> str:
    """Return the tables of a page, a row in each line, tabs between its cells."""
    begin = re.search("(?i)<table", text)
    text = text[begin.start() if begin else 0 :]
    for marks, plain in HTML_MARKS:
        text = re.sub(marks, plain, text)
    rows = (line.lstrip(" ").removeprefix("\t").split("\t") for line in html.unescape(text).split("\n"))
    return "\n".join("\t".join(cell.strip() for cell in row).rstrip() for row in rows)


def _check_content(path: Path, raw: bytes) -> None:
    again = "copy it from the instrument again"
    if not raw:
        raise Refusal(path, "empty file (0 bytes)", again)
    if raw in (codecs.BOM_UTF8, codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
        raise Refusal(path, f"a byte-order mark and nothing else ({len(raw)} bytes)", again)
    if raw.startswith(b"version https://git-lfs"):
        raise Refusal(path, "a Git LFS pointer, not the log itself", "run `git lfs pull` in its repository")
    if not raw.strip(b"\0"):
        raise Refusal(path, "nothing but NUL bytes (a copy broken off)", again)
    if not raw.strip(b"\0 \t\r\n\xef\xbb\xbf\xff\xfe"):
        raise Refusal(path, "nothing but blanks", again)
    if raw.startswith(b"PK\x03\x04") and raw[30 : 30 + int.from_bytes(raw[26:28], "little")].endswith(b".npy"):
        raise Refusal(path, "a NumPy archive (.npz), which mrfit does not read", "save its arrays as HDF5 or MAT")
    for magic, what, remedy in CONTAINERS:
        if raw.startswith(magic):
            raise Refusal(path, f"{what}, which holds no log mrfit reads", remedy)


def encoding_of(raw: bytes) -> str:
    """Return the encoding of text, or the empty string for binary data."""
    if raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    if raw.startswith(codecs.BOM_UTF8):
        return "utf-8-sig"
    if half := _utf16_without_mark(raw):
        return half
    if _control_share(raw) > 0.002:
        return ""
    try:
        codecs.getincrementaldecoder("utf-8")().decode(raw)
    except UnicodeDecodeError:
        return _of_known_names(raw) or _single_byte(raw)
    return "utf-8"


def _of_known_names(raw: bytes) -> str:
    """Return the encoding in which a file has a name of a channel in other letters than Latin; empty without one."""
    names = [a for c in CHANNELS.values() for a in c.aliases if len(a) > 1 and a[0] >= CYRILLIC]
    for encoding in OTHER_LETTERS:
        try:
            text = codecs.getincrementaldecoder(encoding)().decode(raw).lower()
        except UnicodeDecodeError:
            continue
        if any(name in text for name in names):
            return encoding
    return ""


def _utf16_without_mark(raw: bytes) -> str:
    even, odd = raw[0::2], raw[1::2]
    if len(odd) < 8:
        return ""
    if odd.count(0) > 0.9 * len(odd) and even.count(0) < 0.1 * len(even):
        return "utf-16-le"
    if even.count(0) > 0.9 * len(even) and odd.count(0) < 0.1 * len(odd):
        return "utf-16-be"
    return ""


def _control_share(raw: bytes) -> float:
    # NUL is left out: it damages text logs, and lines that hold one are refused one by one
    control = bytes(b for b in range(1, 32) if b not in b"\t\n\v\f\r\x1a\x1b")
    return 1.0 - len(raw.translate(None, control)) / len(raw)


def _single_byte(raw: bytes) -> str:
    from charset_normalizer import from_bytes

    best = from_bytes(raw[:8192], cp_isolation=SINGLE_BYTE, threshold=1.0).best()
    return best.encoding if best else "latin_1"


def decode(raw: bytes, encoding: str) -> str:
    """Return text with every kind of line end as a plain line feed; undecodable bytes become U+FFFD."""
    text = raw.decode(encoding, errors="replace").removeprefix("\ufeff")
    return re.sub("\r\r?\n|\r", "\n", text)


def last_lines(head: Head) -> list[str]:
    """Return whole lines at the end of a file that is longer than its head."""
    if head.size <= len(head.raw) or head.encoding.startswith("utf-16"):
        return []
    with head.path.open("rb") if head.unpacked is None else io.BytesIO(head.unpacked) as handle:
        handle.seek(max(len(head.raw), head.size - TAIL_BYTES))
        return handle.read().decode(head.encoding, errors="replace").splitlines()[1:]


def body_bytes(head: Head) -> bytes:
    """Return the whole file as bytes in which digits, delimiters and line feeds are ASCII.

    Line numbers agree with ``head.lines``.
    """
    data = head.path.read_bytes() if head.unpacked is None else head.unpacked
    if head.encoding.startswith("utf-16"):
        return decode(data, head.encoding).encode()
    return plain_feeds(data.removeprefix(codecs.BOM_UTF8))


def plain_feeds(data: bytes) -> bytes:
    """Return text with plain line feeds where its line ends are mixed or old; CR LF throughout stays."""
    if b"\r" in data and data.count(b"\r\n") != data.count(b"\r"):
        return re.sub(b"\r\r?\n|\r", b"\n", data)
    return data


def body_view(head: Head) -> Text:
    """Return the same without a copy where the file needs no rewriting, which is 20 ms for every 40 MB."""
    if head.unpacked is not None or head.encoding.startswith("utf-16") or head.raw.startswith(codecs.BOM_UTF8):
        return body_bytes(head)
    with head.path.open("rb") as handle:
        data = mmap.mmap(handle.fileno(), 0, access=mmap.ACCESS_READ)
    if data.find(b"\r") >= 0 and not _ends_in_pairs(data):
        return body_bytes(head)
    return data


def _ends_in_pairs(data: mmap.mmap) -> bool:
    """Whether every carriage return is followed by a line feed, and only by one."""
    whole = np.frombuffer(data, np.uint8)
    for start in range(0, len(whole), TEXT_CHUNK):
        part = whole[start : start + TEXT_CHUNK + 1]
        returns = np.flatnonzero(part[:TEXT_CHUNK] == RETURN) + 1
        if np.any(returns >= len(part)) or np.any(part[returns] != FEED):
            return False
    return True


def feeds(data: Text, start: int, stop: int) -> int:
    """Return the number of line feeds in a span."""
    whole = np.frombuffer(data, np.uint8, stop - start, start) if stop > start else np.empty(0, np.uint8)
    return sum(int(np.count_nonzero(whole[k : k + TEXT_CHUNK] == FEED)) for k in range(0, len(whole), TEXT_CHUNK))
