"""Predictions that are kept: of logs with and without the output, and on the page of the report."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mrfit.fit.stage
import mrfit.report.stage
from mrfit.api.kept_prediction import PredictionRecord, save, trained_on
from mrfit.errors import ConfigError, DataError
from mrfit.fit.predict import SegmentPrediction, predict
from mrfit.fit.select import read_dataset
from mrfit.fit.stage import Settings
from mrfit.io import columns, memory
from mrfit.io.dataset import Dataset
from mrfit.io.replaced import replaced_files
from mrfit.io.schemas.fit import Fit
from mrfit.io.workspace import Workspace
from mrfit.report.source import read_source
from mrfit.simulate.assembly import assemble
from mrfit.simulate.current_levels import assembly_of
from tests.fit.benches import Bench, write_workspace

TRUTH = np.array([300.0, 900.0, 5.0])


def logs(folder: Path, amplitude: float = 0.010) -> Workspace:
    return write_workspace(folder, Bench(assemble("bingham"), TRUTH, 0.01, 1), ((2.0, amplitude),), (1.0,))


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> tuple[Workspace, Fit]:
    workspace = logs(tmp_path_factory.mktemp("fit"))
    return workspace, mrfit.fit.stage.run(workspace, Settings("bingham", "lsq", per="all"))


def without_force(dataset: Dataset) -> Dataset:
    found = {
        i: replace(r, channels={n: v for n, v in r.channels.items() if n != "force"})
        for i, r in dataset.recordings.items()
    }
    return Dataset(dataset.segments, found)


def test_a_log_without_the_output_is_simulated_as_one_with_it(fitted: tuple[Workspace, Fit], tmp_path: Path) -> None:
    dataset = read_dataset(logs(tmp_path, 0.008))
    measured, alone = predict(fitted[1], dataset), predict(fitted[1], without_force(dataset))
    assert alone.metrics == [] and len(alone.unmeasured) == len(dataset.segments)
    assert measured.unmeasured == frozenset() and measured.metrics
    for one, other in zip(measured.simulated, alone.simulated, strict=True):
        assert other == pytest.approx(one, abs=1e-9 * np.ptp(one))


def test_ranges_of_the_fit_are_those_of_its_training(fitted: tuple[Workspace, Fit], tmp_path: Path) -> None:
    trained = trained_on(*fitted)
    assert trained["velocity"][1] == pytest.approx(0.010 * 4.0 * np.pi, rel=0.01)
    wide = predict(fitted[1], read_dataset(logs(tmp_path, 0.03)), trained)
    assert {w.text.partition(" ")[0] for w in wide.warnings if w.kind == "extrapolation"} >= {"velocity"}
    same = predict(fitted[1], read_dataset(fitted[0]), trained)
    assert [w.kind for w in same.warnings] == []


def test_what_holds_all_samples_says_how_much_that_is_before_it_reads_them(
    fitted: tuple[Workspace, Fit], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(memory, "TOLD_BYTES", 0.0)
    monkeypatch.setattr(memory, "free_memory", lambda: 5e9)
    told: list[str] = []
    root = str(fitted[0].root)
    for read, what in (
        # as a report, and predict of what it was trained on; as predict, compare, discover and advise of recordings
        (lambda: read_source(fitted[0], ()), f"{root}: all samples of 1 fit"),
        (lambda: read_dataset(fitted[0]), f"{root}: all samples of 1 recording"),
    ):
        memory.on_need(told.append)
        read()
        assert told[0] == f"{what} are held in memory: about 0.0 GB, 5.0 GB are free"
        told.clear()
    # a fit reads long recordings piece by piece
    monkeypatch.setattr(columns, "LONG_SEGMENT", 100)
    memory.on_need(told.append)
    read_dataset(fitted[0], streamed=True)
    memory.on_need(None)
    assert told == []


def kept(found: SegmentPrediction, fitted: tuple[Workspace, Fit], name: str, log: str = "a.csv") -> list[str]:
    return save(fitted[0], name, PredictionRecord(fitted[1], [log], ["odd"]), found, assembly_of(fitted[1]))


@pytest.mark.parametrize("name", ["one", "two.csv"])
def test_every_sample_is_kept_and_the_page_has_a_row(fitted: tuple[Workspace, Fit], tmp_path: Path, name: str) -> None:
    import pyarrow.csv
    import pyarrow.parquet

    found = predict(fitted[1], read_dataset(logs(tmp_path, 0.008)))
    data, figure = kept(found, fitted, name, "<logs>/b.csv")
    table = pyarrow.csv.read_csv(data) if data.endswith("csv") else pyarrow.parquet.read_table(data)
    assert table.column("simulated").to_numpy() == pytest.approx(np.concatenate(found.simulated), rel=1e-12)
    assert Path(figure).read_text(encoding="utf-8").startswith("<?xml")
    about = json.loads(Path(data).with_suffix(".json").read_text(encoding="utf-8"))
    assert about["findings"] == ["odd"] and about["metrics"][-1]["condition"] == "all"
    mrfit.report.stage.run(fitted[0], mrfit.report.stage.Settings())
    page = (fitted[0].report_folder / "index.html").read_text(encoding="utf-8")
    assert 'id="predictions"' in page and "&lt;logs&gt;/b.csv" in page and "<logs>" not in page


def test_what_was_not_measured_is_said_on_the_page(fitted: tuple[Workspace, Fit], tmp_path: Path) -> None:
    found = predict(fitted[1], without_force(read_dataset(logs(tmp_path, 0.008))))
    (data, _) = kept(found, fitted, "alone")
    import pyarrow.parquet

    assert np.isnan(pyarrow.parquet.read_table(data).column("measured").to_numpy()).all()
    mrfit.report.stage.run(fitted[0], mrfit.report.stage.Settings())
    page = (fitted[0].report_folder / "index.html").read_text(encoding="utf-8")
    assert ">not measured</td>" in page


def test_a_prediction_of_a_name_has_one_table_and_no_ending_of_another_format(
    fitted: tuple[Workspace, Fit], tmp_path: Path
) -> None:
    found = predict(fitted[1], read_dataset(logs(tmp_path)))
    for name in ("twice.xlsx", "twice.CSV", "twice.xls.csv"):
        with pytest.raises(ConfigError, match=rf"^--save '{name}': a prediction is written as .parquet or .csv"):
            kept(found, fitted, name)
    (data, _), folder = kept(found, fitted, "twice"), fitted[0].root / "predict"
    with replaced_files() as replaced:
        (other, _) = kept(found, fitted, "twice.csv")
    assert Path(data) in replaced and not Path(data).exists() and Path(other).is_file()
    # a number in a name is no ending
    assert kept(found, fitted, "at_0.5Hz")[0] == str(folder / "at_0.5Hz.parquet") and Path(other).is_file()


def test_names_and_files_of_others_are_refused(fitted: tuple[Workspace, Fit], tmp_path: Path) -> None:
    found = predict(fitted[1], read_dataset(logs(tmp_path)))
    with pytest.raises(ConfigError, match="^--save '.*' is no name for a file"):
        kept(found, fitted, "../out")
    (data, _) = kept(found, fitted, "edited")
    path = Path(data).with_suffix(".json")
    path.write_text(path.read_text().replace("edited.parquet", "../../secret.parquet"))
    with pytest.raises(DataError, match="no file of this folder"):
        mrfit.report.stage.run(fitted[0], mrfit.report.stage.Settings())
    path.unlink()
