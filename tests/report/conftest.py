from pathlib import Path
from typing import Any

import pytest

from mrfit.io.workspace import Workspace
from mrfit.report.stage import Settings, run
from tests.report.studies import coil_study, damper_study


@pytest.fixture(scope="session")
def coil(tmp_path_factory: pytest.TempPathFactory) -> tuple[Workspace, dict[str, Any]]:
    workspace = coil_study(tmp_path_factory.mktemp("coil") / "w")
    return workspace, run(workspace, Settings())


@pytest.fixture(scope="session")
def damper(tmp_path_factory: pytest.TempPathFactory) -> tuple[Workspace, dict[str, Any]]:
    workspace = damper_study(tmp_path_factory.mktemp("damper") / "w")
    return workspace, run(workspace, Settings())


@pytest.fixture
def small(tmp_path: Path) -> Workspace:
    return damper_study(tmp_path / "w", conditions=1)
