"""No code from the current folder, which is often that of the logs: neither modules nor programs nor settings.

Nothing is imported here but what Python has loaded as it starts, since it may lie in that folder.
"""

import os
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from importlib.machinery import ModuleSpec
    from types import ModuleType

# Variables that list folders of code; an empty or relative part of one means the current folder or one in it
PATHS = (
    *("PATH", "PYTHONPATH", "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "DYLD_FALLBACK_LIBRARY_PATH", "HDF5_PLUGIN_PATH"),
    *("LIBRARY_PATH", "COMPILER_PATH", "CPATH", "C_INCLUDE_PATH", "OCTAVE_PATH"),
)


def leave_out() -> None:
    """Import no more from the current folder in this process, a command, and find no programs there.

    Python puts it first for ``python -m``, and where a part of PYTHONPATH is empty or relative.
    """
    named = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    relative = {os.path.abspath(p) for p in ("", *named) if not os.path.isabs(p)}
    # folders that were named in full, and a checkout from which mrfit is run
    kept = {*filter(os.path.isabs, named), os.path.dirname(os.path.dirname(os.path.dirname(__file__)))}
    sys.path[:] = [p for p in sys.path if os.path.isabs(p) and (p not in relative or p in kept)]
    os.environ.update(without_relative(os.environ))
    sys.meta_path.insert(0, MatplotlibFinder())


def without_relative(environment: "Mapping[str, str]") -> dict[str, str]:
    """Return those variables of ``PATHS`` that there are, with the folders that are named in full."""
    return {
        name: os.pathsep.join(filter(os.path.isabs, environment[name].split(os.pathsep)))
        for name in PATHS
        if name in environment
    }


class HiddenFileFinder:
    """Hides a file of the current folder from a library that looks for it while this thread imports it.

    Parameters
    ----------
    name
        Name of the file, as the library asks for it.
    """

    def __init__(self, name: str) -> None:
        self.name = name

    def __enter__(self) -> None:
        from threading import get_ident

        there, thread = os.path.exists, get_ident()
        self.there = there
        os.path.exists = lambda path: there(path) and not (path == self.name and get_ident() == thread)

    def __exit__(self, *_: object) -> None:
        os.path.exists = self.there


class MatplotlibFinder:
    """Finds matplotlib as any other finder does, and hides its settings beside logs while it is loaded."""

    def find_spec(self, name: str, path: "Sequence[str] | None" = None, target: object = None) -> "ModuleSpec | None":
        """Return the place of matplotlib; of other modules nothing is known here."""
        if name != "matplotlib":
            return None
        # those behind it alone: two of a kind would ask each other without end
        others = sys.meta_path[sys.meta_path.index(self) + 1 :]
        spec = next((s for f in others if (s := f.find_spec(name, path)) is not None), None)
        if spec is not None and spec.loader is not None:
            load = spec.loader.exec_module

            def load_without_settings(module: "ModuleType") -> None:
                with HiddenFileFinder("matplotlibrc"):
                    load(module)

            spec.loader.exec_module = load_without_settings  # type: ignore[method-assign]
        return spec


if sys.flags.safe_path:
    sys.meta_path.insert(0, MatplotlibFinder())
