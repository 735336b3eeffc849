"""What can go wrong, each kind with the exit code the shell sees.

Every message is one line that says which file or name, which row where there is one, and what to do about it.
"""

import errno
from collections.abc import Iterable
from difflib import get_close_matches


class MrfitError(Exception):
    """Base of all errors a user can mend; shown as one line, without a traceback unless ``--debug`` is given."""

    exit_code = 1


class DataError(MrfitError):
    """The data or the fit cannot be used (exit code 1)."""


class MissingResource(DataError):
    """The machine lacks what the data need, as memory, room, a library or a permission; the data may be sound."""


class ConfigError(MrfitError):
    """The command line or a configuration file is wrong (exit code 2)."""

    exit_code = 2


class Unreachable(MrfitError):
    """Nobody is there to do the work, or no longer; it is of the place where work is done, not of data or a model."""


def is_of_machine(error: BaseException) -> bool:
    """Return whether an error, or what led to it, is the machine's and not of the data: it may pass."""
    one: BaseException | None = error
    while one is not None:
        # a library that cannot make sense of a file raises an OSError too, without a number or with that of a bad seek
        of_system = isinstance(one, OSError) and one.errno not in (None, errno.EINVAL)
        if of_system or isinstance(one, (MissingResource, MemoryError, ImportError)):
            return True
        one = one.__cause__ or one.__context__
    return False


def unknown_name(kind: str, name: str, known: list[str], command: str = "") -> ConfigError:
    """Return the error for a name that no registry holds, with near matches and the whole list.

    Parameters
    ----------
    kind
        What was asked for, as in ``model`` or ``optimizer``.
    name
        The name that was not found.
    known
        All names there are.
    command
        What shows them; default: ``mrfit list`` with the kind.
    """
    near = get_close_matches(name, known, n=3, cutoff=0.5)
    hint = f"did you mean {' or '.join(near)}?" if near else f"choose one of {', '.join(known)}"
    return ConfigError(f"unknown {kind} '{name}': {hint} (`{command or f'mrfit list {kind}s'}` shows all)")


def near(name: str, known: Iterable[str]) -> str:
    """Return the end of a message on an unknown name: the nearest of several known ones; empty where none is near."""
    listed = list(known)
    found = get_close_matches(name, listed, n=1, cutoff=0.5)
    return f"; did you mean {found[0]}?" if found and len(listed) > 1 else ""
