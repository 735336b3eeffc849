"""The one compile policy of all numba code: ahead in a cache folder keyed by the jitted sources, GIL released.

numba's own cache sees an edit in the file of the function it compiles, not in the files that function calls; the key of
the folder is a hash over all kernel sources, so that any edit starts afresh.
"""

import hashlib
import math
import os
import stat
import tempfile
import threading
from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar, cast

import numpy as np
from filelock import FileLock

from mrfit.core import temporary
from mrfit.core.current_folder import HiddenFileFinder
from mrfit.core.progress import tell_compilation
from mrfit.core.workers import interrupts_later

F = TypeVar("F", bound=Callable[..., Any])


def _cache_folder() -> Path:
    package = Path(__file__).parents[1]
    folders = ("kernels", "models", "effects", "simulate", "driven", "apply")
    sources = [s for folder in folders for s in sorted((package / folder).glob("*.py"))]
    key = hashlib.sha256(b"".join(s.read_bytes() for s in sources)).hexdigest()[:16]
    # a folder that is not named in full lies beside the logs, and what is compiled is code
    caches = (os.environ.get("MRFIT_CACHE", ""), os.environ.get("XDG_CACHE_HOME", ""), os.path.expanduser("~/.cache"))
    own = [Path(folder) / "mrfit" for folder in filter(os.path.isabs, caches)][:1]
    # the current folder where no other can be written to
    common = Path(tempfile.gettempdir())
    parents = [*own, *([common / f"mrfit-{_user()}"] if common != Path(os.path.abspath("")) else [])]
    for parent in parents:
        folder = parent / f"kernels-{key}"
        if (parent in own or _is_private(parent)) and _is_private(folder):
            return folder
    # somebody else made folders of these names: compiled code from there would be theirs
    return temporary.kept("kernels")


def _user() -> str:
    return str(os.getuid()) if hasattr(os, "getuid") else "kernels"


def _is_private(folder: Path) -> bool:
    """Make a folder if it is not there; return whether the user owns it, can write there, and nobody else can."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = folder.lstat()
    except OSError:
        return False
    if not stat.S_ISDIR(found.st_mode) or not os.access(folder, os.W_OK):
        return False
    # elsewhere than on Unix the temporary folder is each user's own
    return not hasattr(os, "getuid") or (found.st_uid == os.getuid() and not found.st_mode & 0o022)


if not os.path.isabs(os.environ.get("NUMBA_CACHE_DIR", "")):
    os.environ["NUMBA_CACHE_DIR"] = str(_cache_folder())
# numba reads settings that lie in the current folder, as it is imported and again whenever it compiles
SETTINGS = ".numba_config.yaml"
with HiddenFileFinder(SETTINGS):
    import numba  # the cache folder must be set before
from numba.core import config, event  # noqa: E402
from numba.core.caching import NullCache  # noqa: E402
from numba.core.compiler_lock import global_compiler_lock  # noqa: E402

config._config_fname = os.devnull
from numba.cpython.unsafe.tuple import tuple_setitem  # noqa: E402
from numba.extending import intrinsic, overload  # noqa: E402


class _Interrupts(event.Listener):
    """Holds an interrupt back while kernels are compiled: LLVM's calls back into Python would swallow it."""

    def __init__(self) -> None:
        self.depth = 0
        self.held = ExitStack()

    def on_start(self, event: Any) -> None:
        """Begin to hold interrupts back at the outermost compilation of the main thread, where they arrive."""
        if threading.current_thread() is threading.main_thread():
            self.depth += 1
            if self.depth == 1:
                self.held.enter_context(interrupts_later())

    def on_end(self, event: Any) -> None:
        """Let an interrupt that came meanwhile through."""
        if threading.current_thread() is threading.main_thread():
            self.depth -= 1
            if self.depth == 0:
                self.held.close()


event.register("numba:compiler_lock", _Interrupts())  # type: ignore[no-untyped-call]


def _misfit(source: Any, target: Any) -> None:
    """Stand for what numba calls in a kernel where an array does not fit the slice that it is assigned to."""


def _refusal(source: Any, target: Any) -> Callable[[Any, Any], None]:
    def refuse(source: Any, target: Any) -> None:
        raise ValueError("an array does not fit the slice that it is assigned to")

    return refuse


overload(_misfit)(_refusal)


class _Compilation(event.Listener):
    """Hears of kernels that are compiled, not read from the cache.

    It puts ``_misfit`` in place of numba's own, whose text of both shapes takes each such kernel 2 s to compile. It
    tells of those that are kept on disk: each plug-in's are compiled by every command.
    """

    depth = 0

    def on_start(self, event: Any) -> None:
        """Tell of the outermost kernel; the module of numba's own takes 0.1 s to import."""
        from numba.np import arrayobj

        arrayobj.raise_with_shape_context = _misfit
        if _is_kept(event.data["dispatcher"]):
            if not self.depth:
                tell_compilation(0)
            self.depth += 1

    def on_end(self, event: Any) -> None:
        """Tell of the end of the outermost kernel."""
        if _is_kept(event.data["dispatcher"]):
            self.depth -= 1
            if not self.depth:
                tell_compilation(1)


def _is_kept(dispatcher: Any) -> bool:
    return not isinstance(dispatcher._cache, NullCache)


event.register("numba:compile", _Compilation())  # type: ignore[no-untyped-call]


# Seconds that a process waits for another to compile a kernel
_PATIENCE = 60.0


def is_cold() -> bool:
    """Return whether no kernel has been compiled before: the first search then takes half a minute longer."""
    return next(Path(os.environ["NUMBA_CACHE_DIR"]).rglob("*.nbi"), None) is None


def kernel(function: F, kept: bool = True, counted: bool = True) -> F:
    """Compile a function of arrays and floats: cached, without the GIL, division by zero as in IEEE 754.

    What is not mrfit's own is not ``kept`` on disk: the folder's key does not know its source.
    """
    options: Any = {"cache": kept, "nogil": True, "error_model": "numpy", "fastmath": {"contract"}, "_nrt": counted}
    # what other kernels alone call needs no entry from Python, which for tuples of arrays takes long to compile
    inner = not counted and function.__name__.startswith("_")
    options |= {"no_cfunc_wrapper": True, "no_cpython_wrapper": inner}
    compiled: Any = numba.njit(**options)(function)
    own_compile, own_template = compiled.compile, compiled.get_call_template
    path = Path(os.environ["NUMBA_CACHE_DIR"]) / f"{function.__module__}.{function.__name__}.lock"
    # a lock is of the process that made it: one that a fork inherits refuses to be taken
    locks = dict[int, FileLock]()

    general: Any = numba.types.unliteral

    def compile_once(types: Any) -> Any:
        with ExitStack() as held:
            held.enter_context(global_compiler_lock)
            if kept and types not in compiled.overloads:
                # another process may compile it now, and leave it in the cache; where files cannot be locked, twice
                with suppress(OSError, NotImplementedError):
                    lock = locks.setdefault(os.getpid(), FileLock(path))
                    held.enter_context(lock.acquire(timeout=_PATIENCE))
            return own_compile(types)

    def template_of(arguments: Any, keywords: Any) -> Any:
        # numba would compile it again for every constant that a call gives
        plain = {name: general(kind) for name, kind in keywords.items()}
        return own_template(tuple(general(kind) for kind in arguments), plain)

    compiled.compile, compiled.get_call_template = compile_once, template_of
    if inner:
        # a call from Python would end the process
        compiled._insert, compiled._compile_for_args = _pass_over, _refuse_python
    return cast(F, compiled)


def _pass_over(*given: Any) -> None:
    """Do nothing."""


def _refuse_python(*given: Any, **named: Any) -> None:
    raise TypeError("a borrowing kernel whose name begins with _ can be called by kernels alone")


def borrowing(function: F) -> F:
    """Compile a kernel that makes and returns no arrays: references to those it is given are not counted.

    Of a short one, counting takes most of its time. One whose name begins with _ can be called by kernels alone.
    """
    return kernel(function, counted=False)


def inlined(function: F) -> F:
    """Compile a function whose code stands wherever it is called: loops that call it can then run side by side."""
    compiled: Any = numba.njit(nogil=True, error_model="numpy", fastmath={"contract"}, forceinline=True)(function)
    return cast(F, compiled)


def part(function: F) -> F:
    """Compile a function as a part of its one caller, which takes half the time of a kernel of its own."""
    compiled: Any = numba.njit(inline="always", nogil=True, error_model="numpy", fastmath={"contract"})(function)
    return cast(F, compiled)


def copy_of(template: F, name: str, parts: Mapping[str, Any]) -> F:
    """Return a template for one element: functions and constants of these names take the place of its globals.

    A copy with a name of its own is cached on disk, which a closure over a function is not.
    """
    code: Any = template
    copied: Any = FunctionType(
        code.__code__, {**code.__globals__, **parts}, f"{code.__name__}_{name.replace('-', '_')}"
    )
    copied.__qualname__ = copied.__name__
    return cast(F, copied)


_set: Any = tuple_setitem


@kernel
def row(values: Any, first: int, empty: Any) -> Any:
    """Return as many values as the tuple ``empty`` has, from a place of a flat array or pointer on, as a tuple."""
    for k in range(len(empty)):
        empty = _set(empty, k, values[first + k])
    return empty


def where(condition: Any, one: Any, other: Any) -> Any:
    """Return one where a condition holds, else the other, of arrays or, in kernels, of numbers."""
    return np.where(condition, one, other)


def clip(x: Any, low: Any, high: Any) -> Any:
    """Return x within bounds, of arrays or, in kernels, of numbers."""
    return np.clip(x, low, high)


def erf(x: Any) -> Any:
    """Return the error function, of arrays or, in kernels, of numbers."""
    from scipy.special import erf

    return erf(x)


@overload(where, strict=False)
def _where(condition: Any, one: Any, other: Any) -> Any:
    return lambda condition, one, other: one if condition else other


@overload(clip, strict=False)
def _clip(x: Any, low: Any, high: Any) -> Any:
    return lambda x, low, high: min(max(x, low), high)


@overload(erf, strict=False)
def _erf(x: Any) -> Any:
    return lambda x: math.erf(x)


def _bitcast(result: Any, argument: Any) -> Any:
    """Return a numba intrinsic that reads the bits of a value of one type as a value of another."""

    def typing(context: Any, value: Any) -> Any:
        def build(target: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.bitcast(arguments[0], target.get_value_type(result))

        return result(argument), build

    return intrinsic(typing)


def address_of(function: Callable[..., Any], kept: bool, counted: bool = True) -> int:
    """Compile a function of the pointers that ``call`` passes; return its address."""
    real: Any = numba.float64
    pointer = numba.types.CPointer(real)  # type: ignore[no-untyped-call]
    signature = real(*[pointer] * 4, real, pointer)
    options: Any = {"cache": kept, "error_model": "numpy", "fastmath": {"contract"}, "_nrt": counted}
    made = numba.cfunc(signature, **options)(function)
    _alive.append(made)
    return int(made.address or 0)


# What addresses point at
_alive: list[Any] = []


def _call(  # noqa: PLR0913
    typing: Any, address: Any, state: Any, i: Any, following: Any, j: Any, inputs: Any, k: Any, theta: Any, n: Any,
    dt: Any, past: Any, q: Any,
) -> Any:  # fmt: skip
    """Call a compiled function at an address: arrays, each with the place from which it sees them, and dt."""
    arrays = (state, following, inputs, theta, past)

    def build(target: Any, builder: Any, signature: Any, given: Any) -> Any:
        from llvmlite import ir  # type: ignore[import-untyped]

        def place(index: int) -> Any:
            data = target.make_array(signature.args[index])(target, builder, given[index]).data
            return builder.gep(data, [given[index + 1]])

        passed = [*(place(index) for index in (1, 3, 5, 7)), given[9], place(10)]
        shape = ir.FunctionType(ir.DoubleType(), [a.type for a in passed])
        return builder.call(builder.inttoptr(given[0], shape.as_pointer()), passed)

    pairs = [kind for array in arrays[:4] for kind in (array, numba.intp)]
    return numba.float64(numba.int64, *pairs, numba.float64, past, numba.intp), build


call: Any = intrinsic(_call)


def _array_at(typing: Any, pointer: Any, size: Any) -> Any:
    """Return numbers from a pointer on as an array; numba's own refuses where references are not counted."""

    def build(target: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        from numba.np.arrayobj import populate_array

        made = target.make_array(signature.return_type)(target, builder)
        step = target.get_constant(numba.intp, 8)
        populate_array(made, arguments[0], [arguments[1]], [step], step, None)  # type: ignore[no-untyped-call]
        return made._getvalue()

    return numba.float64[::1](pointer, numba.intp), build


array_at: Any = intrinsic(_array_at)


def length_in_memory(sample: Any) -> int:
    """Return the length in float64 of a tuple like a sample."""
    from numba.core.registry import cpu_target

    context = cpu_target.target_context
    size: int = context.get_abi_sizeof(context.get_value_type(_kind_of(sample)))
    return -(-size // 8)


def _kind_of(sample: Any) -> Any:
    return numba.typeof(sample)  # type: ignore[no-untyped-call]


def tuple_in_memory(sample: Any) -> tuple[Any, Any]:
    """Return a kernel that writes a tuple like a sample to an array of float64, and one that reads it at a pointer.

    References are not counted: the tuple's arrays have to be kept.
    """

    def write(typing: Any, to: Any, value: Any) -> Any:
        def build(target: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            data = target.make_array(signature.args[0])(target, builder, arguments[0]).data
            builder.store(arguments[1], builder.bitcast(data, arguments[1].type.as_pointer()))
            return target.get_dummy_value()

        return numba.void(to, _kind_of(sample)), build

    def read(typing: Any, pointer: Any) -> Any:
        def build(target: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.load(builder.bitcast(arguments[0], target.get_value_type(_kind_of(sample)).as_pointer()))

        return _kind_of(sample)(pointer), build

    return intrinsic(write), intrinsic(read)


# The 64 bits of a float64 as an int64, and back: what vector powers are made of.
bits = cast(Callable[[float], int], _bitcast(numba.int64, numba.float64))
from_bits = cast(Callable[[int], float], _bitcast(numba.float64, numba.int64))
