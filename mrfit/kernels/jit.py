"""The one compile policy of all numba code: ahead in a cache folder keyed by the jitted sources, GIL released.

numba's own cache sees an edit in the file of the function it compiles, not in the files that function calls; the key of
the folder is a hash over all kernel sources, so that any edit starts afresh.
"""

import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

F = TypeVar("F", bound=Callable[..., Any])


def _cache_folder() -> Path:
    sources = sorted(Path(__file__).parent.glob("*.py"))
    key = hashlib.sha256(b"".join(s.read_bytes() for s in sources)).hexdigest()[:16]
    root = Path(os.environ.get("MRFIT_CACHE", os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")))
    folder = root / "mrfit" / f"kernels-{key}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if os.access(folder, os.W_OK):
            return folder
    except OSError:
        pass
    return Path(tempfile.gettempdir()) / f"mrfit-kernels-{key}"


os.environ.setdefault("NUMBA_CACHE_DIR", str(_cache_folder()))

import numba  # noqa: E402  (the cache folder must be set before numba is imported)
from numba.extending import intrinsic  # noqa: E402


def is_cold() -> bool:
    """Return whether no kernel has been compiled before: the first search then takes half a minute longer."""
    return next(Path(os.environ["NUMBA_CACHE_DIR"]).rglob("*.nbi"), None) is None


def kernel(function: F) -> F:
    """Compile a function of arrays and floats: cached, without the GIL, division by zero as in IEEE 754."""
    compiled: Any = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})(function)
    return cast(F, compiled)


def _bitcast(result: Any, argument: Any) -> Any:
    """Return a numba intrinsic that reads the bits of a value of one type as a value of another."""

    def typing(context: Any, value: Any) -> Any:
        def build(target: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.bitcast(arguments[0], target.get_value_type(result))

        return result(argument), build

    return intrinsic(typing)


# The 64 bits of a float64 as an int64, and back: what vector powers are made of.
bits = cast(Callable[[float], int], _bitcast(numba.int64, numba.float64))
from_bits = cast(Callable[[int], float], _bitcast(numba.float64, numba.int64))
