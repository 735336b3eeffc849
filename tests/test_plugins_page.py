"""The examples of docs/plugins.md work as they stand."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import ROOT
from tests.core.foreign.compiled import compiled
from tests.plugin_files import run_python

PAGE = (ROOT / "docs" / "plugins.md").read_text()
FY, V0, C, K3 = 150.0, 0.02, 800.0, 4e6


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)


@pytest.fixture
def page(tmp_path: Path) -> Path:
    """The page's files in a folder, with a log of the page's bench."""
    names = ("my_damper.py", "my_spring.py", "my_search.py", "my_reader.py")
    for name, text in zip(names, blocks("python"), strict=True):
        (tmp_path / name).write_text(text)
    t = np.arange(5000) / 1000
    w = 2 * np.pi * 2.0
    x, v = 0.015 * np.sin(w * t), 0.015 * w * np.cos(w * t)
    force = FY * (2 / np.pi) * np.arctan(v / V0) + C * v + K3 * x**3
    force += 0.1 * np.random.default_rng(1).standard_normal(len(t))
    rows = "".join(f"{1e3 * a:.6f};{b:.4f}\n" for a, b in zip(x, force, strict=True))
    (tmp_path / "run1.txt").write_text("ROOM 3 BENCH\n" + rows)
    return tmp_path


@pytest.mark.slow
def test_its_model_effect_optimizer_and_reader_are_used_together(page: Path) -> None:
    around = {"MRFIT_PLUGINS": "my_damper.py:my_spring.py:my_search.py:my_reader.py"}
    assert run_python(page, "mrfit.cli", "ingest", "run1.txt", **around).returncode == 0
    command = ("fit", "--model", "my-damper+my-spring", "--opt", "mysearch-lsq", "--json")
    done = run_python(page, "mrfit.cli", *command, **around)
    assert done.returncode == 0, done.stderr
    fit = json.loads(done.stdout)
    assert [p["value"] for p in fit["results"][0]["parameters"]] == pytest.approx([FY, V0, C, K3], rel=0.02)


def test_they_keep_their_contracts(page: Path) -> None:
    files = ("my_damper.py", "my_spring.py", "my_search.py")
    done = run_python(page, "mrfit.contracts", *files)
    assert "all hold" in done.stdout, done.stdout + done.stderr
    done = run_python(page, "mrfit.contracts", "my_reader.py", "--log", "run1.txt")
    assert "all hold" in done.stdout, done.stdout + done.stderr


def test_its_c_function_is_a_model(page: Path) -> None:
    (source,), tables = blocks("c"), blocks("toml")
    compiled(source, page / "their_damper.so")
    (page / "their.toml").write_text(next(t for t in tables if "[c]" in t))
    done = run_python(page, "mrfit.contracts", "their.toml")
    text = "Parameters may vary along the samples"
    broken = [line for line in done.stdout.splitlines() if "BROKEN" in line]
    # which the page says of such models
    assert [text in line for line in broken] == [True], done.stdout + done.stderr


def test_its_entry_point_is_that_of_the_example_package() -> None:
    (entry,) = [t for t in blocks("toml") if "entry-points" in t]
    assert entry in (ROOT / "tests" / "example_plugin" / "pyproject.toml").read_text()
