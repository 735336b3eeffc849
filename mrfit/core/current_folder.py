"""No code from the current folder, which is often that of the logs: neither modules nor programs nor settings.

Nothing is imported here but what Python has loaded as it starts, since it may lie in that folder.
"""

import os
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping

# Variables that list folders of code; an empty or relative part of one means the current folder or one in it
PATHS = (
    *("PATH", "PYTHONPATH", "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "DYLD_FALLBACK_LIBRARY_PATH", "HDF5_PLUGIN_PATH"),
    *("LIBRARY_PATH", "COMPILER_PATH", "CPATH", "C_INCLUDE_PATH", "OCTAVE_PATH"),
)
_is_left_out = False


def leave_out() -> None:
    """Import no more from the current folder in this process, a command, and find no programs there.

    Python puts it first for ``python -m``, and where a part of PYTHONPATH is empty or relative.
    """
    global _is_left_out
    _is_left_out = True
    named = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    relative = {os.path.abspath(p) for p in ("", *named) if not os.path.isabs(p)}
    # folders that were named in full, and a checkout from which mrfit is run
    kept = {*filter(os.path.isabs, named), os.path.dirname(os.path.dirname(os.path.dirname(__file__)))}
    sys.path[:] = [p for p in sys.path if os.path.isabs(p) and (p not in relative or p in kept)]
    os.environ.update(without_relative(os.environ))


def without_relative(environment: "Mapping[str, str]") -> dict[str, str]:
    """Return those variables of ``PATHS`` that there are, with the folders that are named in full."""
    return {
        name: os.pathsep.join(filter(os.path.isabs, environment[name].split(os.pathsep)))
        for name in PATHS
        if name in environment
    }


def is_left_out() -> bool:
    """Return whether this process is a command, or was started by one; a user's script or notebook is neither."""
    return _is_left_out or bool(sys.flags.safe_path)


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


def without_matplotlibrc() -> HiddenFileFinder:
    """Return an import hook that hides matplotlib's settings beside logs from a command that imports it."""
    return HiddenFileFinder("matplotlibrc" if is_left_out() else "")
