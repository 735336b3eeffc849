"""Models, effects, optimizers and readers from outside the package.

They come from installed packages (entry points ``mrfit.models``, ``mrfit.effects``, ``mrfit.optimizers`` and
``mrfit.readers``), from files that the user names (``--plugin``, or MRFIT_PLUGINS with paths as in PATH), and from
functions decorated in a script or notebook. Nothing else is ever run: no file because it lies beside logs.
"""

import hashlib
import importlib
import inspect
import itertools
import os
import re
import sys
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import TYPE_CHECKING, Any, TypedDict, TypeVar, Unpack

from mrfit.core.arguments import check_arguments
from mrfit.core.built_in import KINDS, Kind, own_module, own_names
from mrfit.core.counting import few
from mrfit.errors import ConfigError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

    from mrfit.core.specs import Array, DerivedQuantity, Param, Response

VARIABLE = "MRFIT_PLUGINS"
GROUPS: dict[Kind, str] = {kind: f"mrfit.{kind}s" for kind in KINDS}
# Endings of the files of an installed package that can change what its items do
CODE = frozenset((".py", ".toml", ".c", ".h", ".so", ".pyd", ".dll", ".dylib", ".fmu"))
ITEM_NAME = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")
Function = TypeVar("Function", bound="Response")


@dataclass(frozen=True)
class Plugin:
    """One item from outside.

    Attributes
    ----------
    kind, name
        What it is, and its name in the registry.
    where
        Where it comes from, in words for a message.
    load
        Returns the item.
    digest
        Returns a hash of its source, which is part of the keys of what was made with it.
    """

    kind: Kind
    name: str
    where: str
    load: Callable[[], Any]
    digest: Callable[[], str]


@dataclass(frozen=True)
class _PluginFile:
    path: Path
    digest: str


@dataclass
class Store:
    """Plug-ins that this process knows.

    Attributes
    ----------
    named
        Items of files and decorated functions.
    files
        Files that were run.
    environment
        MRFIT_PLUGINS as last seen.
    loading
        The file that is being run.
    """

    named: list[Plugin] = field(default_factory=list)
    files: set[Path] = field(default_factory=set)
    environment: str = ""
    loading: _PluginFile | None = None
    found: dict[Kind, dict[str, Plugin]] | None = None


_store = Store()


def found(kind: Kind) -> dict[str, Plugin]:
    """Return all items of a kind from outside, by name.

    Raises
    ------
    ConfigError
        If a name clashes, or a file of MRFIT_PLUGINS cannot be run.
    """
    _read_environment()
    if _store.found is None:
        table: dict[Kind, dict[str, Plugin]] = {k: {} for k in KINDS}
        for plugin in (*installed(), *_store.named):
            _add(table, plugin)
        _store.found = table
    return _store.found[kind]


def _add(table: dict[Kind, dict[str, Plugin]], plugin: Plugin) -> None:
    kind, name = plugin.kind, plugin.name
    other = table[kind].get(name)
    if other or name in own_names(kind):
        before = other.where if other else f"mrfit itself ({own_module(kind, name)})"
        raise ConfigError(f"two {kind}s are called '{name}': {before} and {plugin.where}; rename or leave out one")
    table[kind][name] = plugin


@cache
def installed() -> tuple[Plugin, ...]:
    """Return the items of installed packages; none of them is imported before it is used."""
    from importlib.metadata import entry_points

    every = entry_points()
    return tuple(_of_entry(kind, e) for kind, group in GROUPS.items() for e in every.select(group=group))


def _of_entry(kind: Kind, entry: "EntryPoint") -> Plugin:
    package = f" of the package {entry.dist.name} {entry.dist.version}" if entry.dist else ""
    where = f"{entry.value}{package}"

    @cache
    def load() -> Any:
        try:
            with redirect_stdout(sys.stderr):
                item = entry.load()
        except ConfigError:
            raise
        except (Exception, SystemExit) as error:
            raise ConfigError(f"{where}: {_of_import(error)}; mend or uninstall the package") from error
        check(item, kind, where)
        if item.SPEC.name != entry.name:
            told = f"the entry point calls it '{entry.name}', its SPEC '{item.SPEC.name}'"
            raise ConfigError(f"{where}: {told}; let both be the same")
        return item

    def digest() -> str:
        load()
        return _package_digest(importlib.import_module(entry.module))

    return Plugin(kind, entry.name, where, load, digest)


def _package_digest(module: ModuleType) -> str:
    """Return a hash of the code of the whole package that a module is of."""
    top = importlib.import_module(module.__name__.partition(".")[0])
    folders = [Path(p) for p in getattr(top, "__path__", ())]
    files = [(f, p) for f in folders for p in sorted(f.rglob("*")) if p.suffix in CODE and p.is_file()]
    if not folders and top.__file__:
        files = [(Path(top.__file__).parent, Path(top.__file__))]
    total = hashlib.sha256()
    for folder, path in files:
        total.update(f"{path.relative_to(folder).as_posix()}\0".encode() + hashlib.sha256(path.read_bytes()).digest())
    return total.hexdigest()


def of_files() -> list[Plugin]:
    """Return the items of the files that were run and of decorated functions, in their order."""
    _read_environment()
    return list(_store.named)


def _read_environment() -> None:
    text = os.environ.get(VARIABLE, "")
    if text == _store.environment:
        return
    for path in filter(None, text.split(os.pathsep)):
        use(Path(path))
    _store.environment = text


def use(path: Path | str) -> None:
    """Run a plug-in file, Python or the TOML of somebody else's model, so that its items are found by name.

    It is written into this process's MRFIT_PLUGINS too, so that processes started from here find them as well.

    Raises
    ------
    ConfigError
        If it cannot be read, fails, defines nothing, or a name in it is taken.
    """
    path = Path(path).resolve()
    if path in _store.files:
        return
    try:
        source = path.read_bytes()
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror}); give the path of a plug-in file") from None
    if path.suffix not in (".py", ".toml"):
        raise ConfigError(f"{path}: no plug-in; give a Python file, or the TOML file of a model")
    known = {e for e in os.environ.get(VARIABLE, "").split(os.pathsep) if e}
    before = list(_store.named)
    with _running(_PluginFile(path, hashlib.sha256(source).hexdigest())):
        if path.suffix == ".py":
            _run(path, source)
        else:
            from mrfit.core.foreign.description import read_model

            model = read_model(path)
            register(model.item, digest=model.source)
        if len(_store.named) == len(before):
            raise ConfigError(f"{path}: no model, effect, optimizer or reader in it; give it a SPEC, or decorate one")
    if not known & {str(path)} and path not in {Path(e).resolve() for e in known}:
        _store.environment = os.pathsep.join(filter(None, (os.environ.get(VARIABLE, ""), str(path))))
        os.environ[VARIABLE] = _store.environment


@contextmanager
def _running(file: _PluginFile) -> Iterator[None]:
    """Take items registered meanwhile for the file's, and none of them if the file fails."""
    outer, before = _store.loading, list(_store.named)
    _store.loading = file
    _store.files.add(file.path)
    try:
        yield
    except BaseException:
        _store.files.discard(file.path)
        _store.named, _store.found = before, None
        raise
    finally:
        _store.loading = outer


def _run(path: Path, source: bytes) -> None:
    # the user named the file; not by an import, which would write a __pycache__ beside it
    module = ModuleType(f"mrfit_plugin_{re.sub(r'[^0-9A-Za-z]', '_', path.stem)}")
    module.__file__ = str(path)
    before = sys.modules.get(module.__name__)
    sys.modules[module.__name__] = module
    try:
        # standard output may be one JSON document
        with redirect_stdout(sys.stderr):
            exec(compile(source, str(path), "exec", dont_inherit=True), module.__dict__)
    except (Exception, SystemExit) as error:
        sys.modules.pop(module.__name__)
        if before:
            sys.modules[module.__name__] = before
        if isinstance(error, ConfigError):
            raise
        raise ConfigError(f"{path}{_line_of(error, path)}: {_of_import(error)}; mend the plug-in") from error
    if "SPEC" in module.__dict__:
        register(module)


def place_of(error: BaseException) -> str:
    """Return the file and line of a plug-in in which an error arose, in a worker too; empty if it was in none."""
    text = "".join(traceback.format_exception(error))
    for path in _store.files:
        if lines := re.findall(rf'File "{re.escape(str(path))}", line (\d+)', text):
            return f"{path}, line {lines[-1]}"
    return ""


def said_by_compiler(error: BaseException) -> str:
    """Return the compiler's words on a function of a plug-in, behind its place if known; empty of another error."""
    if not (_store.files and type(error).__module__ == "numba.core.errors"):
        return ""
    lines = [line for line in str(error).splitlines() if not line.startswith("Failed in nopython mode")]
    why = " ".join(itertools.takewhile(lambda line: line.strip() and not line.startswith("During:"), lines))
    places = re.findall(r" at (\S.*) \((\d+)\)$", str(error), re.MULTILINE)
    own = [f"{path}, line {line}" for path, line in places if Path(path) in _store.files]
    where = own[0] if own else few(sorted(_store.files))
    return f"{where}: cannot be compiled: {why}; mend the plug-in (--debug shows more)"


def _line_of(error: BaseException, path: Path) -> str:
    if isinstance(error, SyntaxError) and error.filename == str(path):
        return f", line {error.lineno}"
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
    return f", line {lines[-1]}" if lines else ""


def _of_import(error: BaseException) -> str:
    text = error.msg if isinstance(error, SyntaxError) else str(error)
    return f"{type(error).__name__}: {' '.join(text.split())}"


def register(item: Any, where: str = "", digest: str = "") -> None:
    """Add an item with a SPEC, see ``mrfit.core.protocols``, to the registry.

    Parameters
    ----------
    item
        A module, or an object.
    where
        Where it comes from, in words; default: the plug-in file that is being run.
    digest
        Hash of its source; default: that of the plug-in file, or of the code of the item's functions.

    Raises
    ------
    ConfigError
        If it lacks what its kind must have, or its name is taken.
    """
    from mrfit.core.protocols import kind_of

    file = _store.loading
    where = where or (str(file.path) if file else f"an object of {type(item).__name__}")
    kind = kind_of(getattr(item, "SPEC", None))
    if kind is None:
        raise ConfigError(f"{where}: no SPEC; it is a ModelSpec, an EffectSpec, an OptimizerSpec or a ReaderSpec")
    check(item, kind, where)
    total = hashlib.sha256((f"{file.digest} {digest}" if file else digest or _digest_of(item)).encode()).hexdigest()
    plugin = Plugin(kind, item.SPEC.name, where, lambda: item, lambda: total)
    if not file:  # the cell of a notebook may be run again
        _store.named = [p for p in _store.named if (p.kind, p.name, p.where) != (kind, plugin.name, where)]
    before, found_before = list(_store.named), _store.found
    _store.named, _store.found = [*before, plugin], None
    try:
        found(kind)
    except ConfigError:
        _store.named, _store.found = before, found_before
        raise


def check(item: Any, kind: Kind, where: str) -> None:
    """Check that an item has what its kind must have.

    Raises
    ------
    ConfigError
        If its SPEC is another kind's, its name cannot be written, or a function is missing.
    """
    from mrfit.core.protocols import SLOT_FUNCTIONS, kind_of, required
    from mrfit.core.specs import EffectSpec

    spec = getattr(item, "SPEC", None)
    if kind_of(spec) != kind:
        raise ConfigError(f"{where}: its SPEC is no {kind}'s")
    name = str(spec.name)  # type: ignore[union-attr]
    if not ITEM_NAME.fullmatch(name) or (kind == "optimizer" and "-" in name):
        allowed = "small letters and digits" + ("" if kind == "optimizer" else ", joined by single hyphens")
        raise ConfigError(f"{where}: the name of the {kind} cannot be '{name}': use {allowed}")
    if isinstance(spec, EffectSpec) and spec.slot not in SLOT_FUNCTIONS:
        raise ConfigError(f"{where}: there is no slot '{spec.slot}'; choose one of {', '.join(SLOT_FUNCTIONS)}")
    lacking = [f for f in required(spec) if not callable(getattr(item, f, None))]
    if lacking:
        raise ConfigError(f"{where}: the {kind} '{name}' has no function {' and '.join(lacking)}")
    scales = isinstance(spec, EffectSpec) and spec.slot == "theta"
    if scales and callable(getattr(item, "law", None)) and not getattr(item, "ROLES", ()):
        raise ConfigError(
            f"{where}: the law of '{name}' returns factors, and no ROLES says of which parameters: add, for one "
            'factor, ROLES = ("yield",)'
        )
    if getattr(item, "LATE", 0) and not callable(getattr(item, "longest", None)):
        raise ConfigError(f"{where}: '{name}' has LATE signals and no function longest(theta) that says how late, in s")


def _digest_of(item: Any) -> str:
    """Return the source of an item's functions, or their compiled code where there is no source."""
    functions = [f for f in vars(item).values() if inspect.isfunction(f)]
    # the address of a function is another one in each process
    return re.sub(r" at 0x[0-9a-f]+", "", repr([item.SPEC, *(source_of(f) for f in functions)]))


def source_of(function: Callable[..., Any]) -> str:
    """Return a function's source text; its compiled code where it was typed in."""
    try:
        return inspect.getsource(function)
    except (OSError, TypeError):
        code = getattr(function, "__code__", None)
        return repr((code.co_code, code.co_consts, code.co_names)) if code else repr(type(function))


class About(TypedDict, total=False):
    """Further statements of a decorated model: the fields of ``ModelSpec``, and its function of start values."""

    title: str
    equation: str
    reference: str
    linear: tuple[str, ...]
    rate_independent: bool
    derived: "tuple[DerivedQuantity, ...]"
    passive: tuple[str, float, float]
    jumps: tuple[str, ...]
    rests_at: str
    start_values: "Callable[[Array, Array, float], dict[str, float]]"


@check_arguments
def model(
    name: str,
    inputs: Sequence[str],
    output: str,
    params: "Sequence[Param]",
    batched: bool = True,
    **about: Unpack[About],
) -> Callable[[Function], Function]:
    """Return a decorator that makes a model of a function ``f(drive, theta, dt)``, which itself stays as it is.

    Parameters
    ----------
    name
        Name in the registry.
    inputs, output
        Names of the channels that are the rows of ``drive`` (C, N), and of what it computes.
    params
        Parameters in the order of ``theta``.
    batched
        Whether the function takes all parameter vectors (P, K) at once and returns (P, N). Otherwise it takes one, (K,)
        or, with values that vary along the samples, (K, N), and returns (N,): easier to write, and slower.
    about
        ``title`` (default: the first line of the docstring), ``equation``, ``reference`` and so on.

    Raises
    ------
    ConfigError
        If the name is taken, or cannot be written.
    """

    def decorate(function: Function) -> Function:
        from mrfit.core.responses import one_by_one, quiet
        from mrfit.core.specs import ModelSpec

        told: dict[str, Any] = dict(about)
        starts = told.pop("start_values", None)
        text = inspect.getdoc(function) or ""
        told.setdefault("title", text.partition("\n")[0].rstrip(".") or name)
        for key in ("equation", "reference"):
            told.setdefault(key, "")
        if not batched:
            told["caution"] = ONE_BY_ONE.format(name)
        spec = ModelSpec(name=name, inputs=tuple(inputs), output=output, params=tuple(params), **told)
        response = quiet(function) if batched else one_by_one(function)
        item = SimpleNamespace(SPEC=spec, response=response, __doc__=text)
        if starts:
            item.start_values = starts
        sources = [source_of(f) for f in (function, starts) if f]
        register(item, _place_of(function), repr((spec, sources)))
        return function

    return decorate


ONE_BY_ONE = "the model {} is simulated one parameter vector at a time, which is slower than a model of mrfit's own"


def _place_of(function: Callable[..., Any]) -> str:
    code = getattr(function, "__code__", None)
    name = f"{function.__module__}.{function.__qualname__}"
    if _store.loading and code:
        return f"{code.co_filename}, line {code.co_firstlineno}"
    return f"the function {name}"
