"""What is hidden from libraries and children of the folder that a command runs in, in this process."""

import os
import sys
import threading
from importlib.machinery import ModuleSpec
from pathlib import Path

import pytest

from mrfit.core import children
from mrfit.core.current_folder import PATHS, HiddenFileFinder, MatplotlibFinder, without_relative


def test_of_lists_of_folders_only_those_named_in_full_are_left() -> None:
    parts = os.pathsep.join(["/usr/bin", "", ".", "tools", "/opt/bin", "../up"])
    found = without_relative({"PATH": parts, "PYTHONPATH": "", "HOME": "somewhere", "LIBRARY_PATH": "lib"})
    assert found == {"PATH": f"/usr/bin{os.pathsep}/opt/bin", "PYTHONPATH": "", "LIBRARY_PATH": ""}
    assert {"PATH", "PYTHONPATH", "LD_LIBRARY_PATH", "OCTAVE_PATH"} <= set(PATHS)


def test_a_file_is_hidden_by_its_name_alone_from_this_thread_alone_and_for_a_while(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("settings").touch()
    before, other = os.path.exists, list[bool]()
    with HiddenFileFinder("settings"):
        assert not os.path.exists("settings")
        assert os.path.exists(tmp_path / "settings") and not os.path.exists("nothing")
        thread = threading.Thread(target=lambda: other.append(os.path.exists("settings")))
        thread.start()
        thread.join()
    assert other == [True]
    assert os.path.exists is before and os.path.exists("settings")


class OneModule:
    """Finds matplotlib, with a loader that notes which settings are seen as it loads."""

    def __init__(self) -> None:
        self.seen: list[bool] = []
        self.asked = 0

    def find_spec(self, name: str, path: object = None, target: object = None) -> ModuleSpec:
        self.asked += 1
        return ModuleSpec(name, self)  # type: ignore[arg-type]

    def exec_module(self, module: object) -> None:
        self.seen.append(os.path.exists("matplotlibrc"))


def test_settings_of_matplotlib_that_lie_beside_logs_are_not_seen_while_it_is_loaded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("matplotlibrc").touch()
    finder, before, behind = MatplotlibFinder(), OneModule(), OneModule()
    monkeypatch.setattr(sys, "meta_path", [before, finder, behind])
    assert finder.find_spec("numpy") is None
    spec = finder.find_spec("matplotlib")
    assert spec is not None and spec.loader is not None
    # those before it have been asked already
    assert (before.asked, behind.asked) == (0, 1)
    spec.loader.exec_module(sys)
    assert behind.seen == [False] and os.path.exists("matplotlibrc")


def test_a_child_has_this_process_own_folders_and_no_relative_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", ["", "/one", "two", "/three"])
    monkeypatch.setenv("PYTHONPATH", "/elsewhere")
    monkeypatch.setenv("PATH", os.pathsep.join(["bin", "/usr/bin"]))
    found = children._changes()
    assert found["PYTHONPATH"] == os.pathsep.join(["/one", "/three"])
    assert (found["PATH"], found["PYTHONSAFEPATH"]) == ("/usr/bin", "1")


def test_the_environment_of_children_holds_only_while_they_begin(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", os.pathsep.join(["bin", "/usr/bin"]))
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    before = dict(os.environ)
    with pytest.raises(KeyError), children._environment_of_children():
        assert os.environ["PYTHONSAFEPATH"] == "1" and os.environ["PATH"] == "/usr/bin"
        raise KeyError
    assert dict(os.environ) == before


def test_a_program_of_the_current_folder_is_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for folder in ("", "bin"):
        (tmp_path / folder).mkdir(exist_ok=True)
        program = tmp_path / folder / "fc-list-of-logs"
        program.write_text("#!/bin/sh\n")
        program.chmod(0o755)
    monkeypatch.setenv("PATH", os.pathsep.join(["", ".", "bin"]))
    assert children.program("fc-list-of-logs") is None
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    assert children.program("fc-list-of-logs") == str(tmp_path / "bin" / "fc-list-of-logs")
