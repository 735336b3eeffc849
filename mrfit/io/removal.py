"""Taking fits out of a workspace: each is there whole or not at all, whenever the command is killed."""

import os
import shutil
from collections.abc import Sequence
from pathlib import Path

from mrfit.errors import DataError, near
from mrfit.io.workspace import REMOVED, Workspace, check_name


def check_fits(workspace: Workspace, names: Sequence[str]) -> list[str]:
    """Return names of fits, each once.

    Raises
    ------
    ConfigError
        If a name is no plain one.
    DataError
        If there is no fit of a name.
    """
    chosen, there = list(dict.fromkeys(names)), workspace.fit_folders()
    for name in chosen:
        check_name(name)
    for name in chosen:
        if name not in there:
            known = f"choose from {', '.join(there)}" if there else "there is none"
            raise DataError(f"{workspace.root}: no fit named '{name}'; {known}{near(name, there)}")
    return chosen


def remove_fits(workspace: Workspace, names: Sequence[str]) -> list[str]:
    """Take fits out of a workspace whose lock is held, all or none; return their names, each once.

    Raises
    ------
    ConfigError
        If a name is no plain one.
    DataError
        If there is no fit of a name, or a folder cannot be moved; nothing is removed then.
    """
    chosen = check_fits(workspace, names)
    aside = workspace.root / f"{REMOVED}{os.getpid()}"
    moved: list[tuple[Path, Path]] = []
    try:
        aside.mkdir()
        for name in chosen:
            folder = workspace.fit_folder(name)
            # renamed, it is gone at once; its files are deleted after that
            folder.replace(aside / name)
            moved.append((folder, aside / name))
    except OSError as error:
        for folder, now in moved:
            now.replace(folder)
        aside.rmdir()
        text = error.strerror or error
        raise DataError(f"{workspace.root}: cannot remove fits ({text}); check the permissions of fits/") from error
    shutil.rmtree(aside, ignore_errors=True)
    return chosen
