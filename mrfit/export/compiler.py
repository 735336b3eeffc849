"""The C compiler of this machine, and programs made with it."""

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from mrfit.core import children, temporary
from mrfit.core.specs import Array
from mrfit.errors import ConfigError, DataError

_TRIED = ("gcc", "cc", "clang")


def compiler() -> str | None:
    """Return the C compiler's path: that of the environment's ``CC``, else the first of ``_TRIED``; None if none."""
    asked = os.environ.get("CC", "").strip()
    return next((found for name in ((asked,) if asked else _TRIED) if (found := children.program(name))), None)


def required(what: str) -> str:
    """Return the C compiler's path.

    Raises
    ------
    ConfigError
        If there is none.
    """
    found = compiler()
    if found is None:
        asked = os.environ.get("CC", "").strip()
        tried = f"CC={asked}" if asked else ", ".join(_TRIED)
        raise ConfigError(f"{what} needs a C compiler, and there is none here (tried {tried}): install gcc, or set CC")
    return found


def run_compiler(arguments: Sequence[str | Path], folder: Path, what: str) -> None:
    """Run the compiler in a folder.

    Raises
    ------
    ConfigError
        If there is none.
    DataError
        If it refuses the code.
    """
    done = children.run([required(what), *arguments], folder)
    if done.returncode:
        raise DataError(f"{what}: the compiler refuses the code: {fault(done.stderr)}")


def fault(printed: bytes) -> str:
    """Return the line of what a compiler printed that says what is wrong."""
    text = printed.decode("utf-8", "replace")
    return next((line for line in text.splitlines() if "error" in line), text[:200]).strip()


class CompiledModel:
    """A program that reads rows of doubles, dt and the inputs, and writes output, in_range and more."""

    def __init__(self, program: Path, answers: int) -> None:
        self.program, self.answers = program, answers

    def run(self, inputs: Array, dt: float | Array) -> Array:
        """Return output, in_range and more (A, N) of inputs (C, N) whose steps are dt apart, one number or (N,)."""
        steps = np.broadcast_to(np.asarray(dt, dtype=np.float64), inputs.shape[1:])
        rows = np.ascontiguousarray(np.column_stack([steps, *inputs]))
        done = children.run([self.program], self.program.parent, rows.tobytes())
        if done.returncode:
            text = done.stderr.decode("utf-8", "replace").strip().splitlines()
            raise DataError(f"the exported program fails: {text[0] if text else done.returncode}")
        return np.frombuffer(done.stdout).reshape(-1, self.answers).T


@contextmanager
def compiled(files: Mapping[str, str], answers: int = 2, options: Sequence[str] = ()) -> Iterator[CompiledModel]:
    """Give a program of C files, by name, of which one has ``main``.

    Raises
    ------
    ConfigError
        If there is no compiler.
    DataError
        If the code is refused.
    """
    with temporary.folder("compiled") as place:
        for name, text in files.items():
            (place / name).write_text(text, encoding="ascii")
        sources = [place / name for name in files if name.endswith(".c")]
        run_compiler(["-std=c99", *options, *sources, "-lm", "-o", place / "program"], place, "--to c")
        yield CompiledModel(place / "program", answers)
