"""A fit of several conditions goes on where it was stopped, and no simulation that diverges ends it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mrfit.fit.files
import mrfit.fit.stage
import mrfit.segment.stage
from mrfit.core.recording import Recording
from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.fit.stage import Settings
from mrfit.io.schemas.stages import About
from mrfit.io.workspace import Workspace, read_json, write_json
from mrfit.models import boucwen_flux

TRUTH = np.array([[1.2, 0.018, 1.4, 0.8, 1.2, 1.6, 0.3]])
PER_CYCLE, CYCLES, FREQUENCY = 300, 8, 5.0


@pytest.fixture
def workspace(tmp_path: Path) -> Workspace:
    """Three segmented logs of a coil at 1, 3 and 5 A."""
    workspace = Workspace(tmp_path)
    records = []
    for seed, amplitude in enumerate((1.0, 3.0, 5.0)):
        rng = np.random.default_rng(seed)
        time = np.arange(PER_CYCLE * CYCLES) / (PER_CYCLE * FREQUENCY)
        current: Array = amplitude * np.sin(2 * np.pi * FREQUENCY * time)
        flux = boucwen_flux.response(current[None, :], TRUTH, 1.0)[0] + 1e-4 * rng.standard_normal(len(time))
        name = f"log-{amplitude:g}"
        channels = {"current": current, "flux": flux}
        records.append(
            Recording(name, f"{name}.csv", f"{seed:064d}", "none", 1 / (PER_CYCLE * FREQUENCY), 0.0, channels, {})
        )
        workspace.write_recording(records[-1])
    write_json(workspace.ingest_json, {"recordings": [About.of(r) for r in records], "refused": []})
    mrfit.segment.stage.run(workspace, mrfit.segment.stage.Settings(holdout="none"))
    return workspace


def test_a_stopped_fit_searches_only_the_conditions_it_had_not_finished(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = Settings(model="boucwen-flux")
    whole = mrfit.fit.stage.run(workspace, settings)
    (workspace.fit_folder(settings.fit_name) / "fit.json").unlink()

    searched: list[str] = []
    search = mrfit.fit.stage.search_optimum

    def stops_at_the_third(group, *rest):  # type: ignore[no-untyped-def]
        searched.append(group.name)
        if len(searched) == 3:
            raise KeyboardInterrupt
        return search(group, *rest)

    monkeypatch.setattr(mrfit.fit.stage, "search_optimum", stops_at_the_third)
    with pytest.raises(KeyboardInterrupt):
        mrfit.fit.stage.run(workspace, settings)
    assert read_json(workspace.fit_folder(settings.fit_name) / "fit.json") is None
    resumed = mrfit.fit.stage.run(workspace, settings)
    # the third was begun twice, the first two once
    assert len(searched) == 4
    assert searched[2] == searched[3]
    assert resumed.results == whole.results
    assert not (workspace.fit_folder(settings.fit_name) / ".partial").exists()


def test_other_settings_do_not_take_over_what_a_stopped_fit_had_found(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[str] = []
    search = mrfit.fit.stage.search_optimum

    def counted(group, *rest):  # type: ignore[no-untyped-def]
        calls.append(group.name)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return search(group, *rest)

    monkeypatch.setattr(mrfit.fit.stage, "search_optimum", counted)
    with pytest.raises(KeyboardInterrupt):
        mrfit.fit.stage.run(workspace, Settings(model="boucwen-flux", name="one"))
    stopped = len(calls)
    mrfit.fit.stage.run(workspace, Settings(model="boucwen-flux", name="one", seed=1))
    assert len(calls) - stopped == 3


def test_a_kill_between_tables_and_key_is_not_taken_for_the_fit_before(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = (Settings(model="boucwen-flux", per="all", name="x", fixed=(("n", n),)) for n in (1.4, 1.5))
    mrfit.fit.stage.run(workspace, first)
    table = workspace.fit_folder("x") / "parameters.csv"
    before = table.read_bytes()
    with monkeypatch.context() as patch:

        def killed(path: Path, content: object) -> None:
            raise KeyboardInterrupt

        patch.setattr(mrfit.fit.files, "write_json", killed)
        with pytest.raises(KeyboardInterrupt):
            mrfit.fit.stage.run(workspace, second)
    assert table.read_bytes() != before
    assert not mrfit.fit.stage.run(workspace, first).skipped
    assert table.read_bytes() == before


def test_a_kill_after_the_key_leaves_nothing_of_the_searches(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = Settings(model="boucwen-flux", budget=50)

    def killed(folder: Path) -> None:
        assert any((folder / mrfit.fit.files.PARTIAL).iterdir())
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(mrfit.fit.files, "drop_partial", killed)
        with pytest.raises(KeyboardInterrupt):
            mrfit.fit.stage.run(workspace, settings)
    assert mrfit.fit.stage.run(workspace, settings).skipped
    assert not (workspace.fit_folder(settings.fit_name) / mrfit.fit.files.PARTIAL).exists()


def test_results_do_not_depend_on_the_number_of_workers(workspace: Workspace) -> None:
    one, two = (
        mrfit.fit.stage.run(workspace, Settings(model="boucwen-flux", name=f"j{jobs}", jobs=jobs)).results
        for jobs in (1, 2)
    )
    assert one == two


@pytest.mark.parametrize("intervals", ["hac", "bootstrap", "profile"])
def test_every_kind_of_interval_holds_the_planted_exponent(workspace: Workspace, intervals: str) -> None:
    settings = Settings(model="boucwen-flux", per="all", intervals=intervals)  # type: ignore[arg-type]
    result = mrfit.fit.stage.run(workspace, settings).results[0]
    n = next(p for p in result.parameters if p.name == "n")
    assert n.low < TRUTH[0, 5] < n.high
    assert n.high / n.low < 1.3
    assert result.intervals == intervals
    open_names = {p.name for p in result.parameters if not p.identifiable}
    # of the seven printed parameters, data determine n and four combinations of the others
    assert open_names == {"A", "Lc", "kappa", "beta", "gamma", "D"}
    assert result.conditioning.rank == 5
    assert any("kappa" in s and "D" in s and "leave the output as it is" in s for s in result.identifiability)


def test_a_simulation_that_diverges_is_counted_and_its_parameters_are_kept(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    response = boucwen_flux.response

    def diverging(drive: Array, theta: Array, dt: float) -> Array:
        output = response(drive, theta, dt)
        output[theta[:, 5] > 4.0] = np.nan
        return output

    monkeypatch.setattr(boucwen_flux, "response", diverging)
    result = mrfit.fit.stage.run(workspace, Settings(model="boucwen-flux", per="all", optimizer="pso-fmin")).results
    assert result[0].nonfinite > 0
    assert result[0].first_nonfinite["n"] > 4.0
    assert "non-finite" in [w.kind for w in result[0].warnings]
    assert next(p for p in result[0].parameters if p.name == "n").value < 4.0


def test_all_simulations_diverging_is_an_error_that_shows_one(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    def diverging(drive: Array, theta: Array, dt: float) -> Array:
        return np.full((len(theta), drive.shape[1]), np.nan)

    monkeypatch.setattr(boucwen_flux, "response", diverging)
    monkeypatch.setattr(boucwen_flux, "REDUCED", replace(boucwen_flux.REDUCED, response=diverging, rough=None))
    with pytest.raises(
        DataError, match=r"diverged, as with A=.*the first at current .*; narrow --bounds, or mend the model"
    ):
        mrfit.fit.stage.run(workspace, Settings(model="boucwen-flux", per="all"))
