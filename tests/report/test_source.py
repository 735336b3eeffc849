import json

import numpy as np
import pytest

from mrfit.errors import DataError
from mrfit.io.schemas.fit import Quantity
from mrfit.io.workspace import Workspace
from mrfit.report.key import input_files
from mrfit.report.source import fit_names, read_source


def test_no_fit_names_the_command_that_makes_one(tmp_path):
    with pytest.raises(DataError, match=r"no fit to report; run `mrfit fit --model NAME --work .*` first"):
        fit_names(Workspace(tmp_path), ())


def test_unknown_fit_lists_those_there_are(small):
    with pytest.raises(DataError, match=r"no fit named 'other'; choose from bingham\.lsq\.all"):
        fit_names(small, ("bingham.lsq.all", "other"))


def test_fit_named_twice_is_reported_once(small):
    assert fit_names(small, ("bingham.lsq.all", "bingham.lsq.all")) == ["bingham.lsq.all"]


@pytest.mark.parametrize("damage", ["{", '{"model": "x"}', '{"model": 3}'])
def test_damaged_fit_is_named_with_a_remedy(small, damage):
    path = small.fit_folder("bingham.lsq.all") / "fit.json"
    path.write_text(damage)
    with pytest.raises(DataError, match=r"fit\.json: .*delete it and run `mrfit fit` again") as error:
        read_source(small, ())
    assert "\n" not in str(error.value)


def test_fit_without_results_is_refused(small):
    path = small.fit_folder("bingham.lsq.all") / "fit.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "results": []}))
    with pytest.raises(DataError, match="holds no result"):
        read_source(small, ())


@pytest.mark.parametrize("content", [None, b"", b"no parquet at all"])
def test_damaged_series_are_named_with_a_remedy(small, content):
    path = small.fit_folder("bingham.lsq.all") / "residuals.parquet"
    path.unlink() if content is None else path.write_bytes(content)
    with pytest.raises(DataError, match=r"residuals\.parquet: cannot be read .* again") as error:
        read_source(small, ())
    assert "\n" not in str(error.value)


def test_series_carry_frequency_role_and_inputs(coil):
    source = read_source(coil[0], ())
    series = source.series["boucwen-flux.pso-fmin"]
    assert len(series) == 30
    last = series[-1]
    assert (last.condition, last.role, last.frequency, set(last.inputs)) == (
        "sine-10Hz-5A",
        "holdout",
        10.0,
        {"current"},
    )
    assert last.error == pytest.approx(np.hypot(2e-4, 1e-3 / np.sqrt(2.0)), rel=0.02)
    assert np.allclose(np.diff(last.time), 1.0 / 4000.0)


def test_series_without_segments_table_are_not_periodic(small):
    small.segments_file.unlink()
    source = read_source(small, ())
    assert source.segments == [] and source.series["bingham.lsq.all"][0].frequency == 0.0


def test_floor_is_put_on_the_scale_of_nrmse(damper):
    row = read_source(damper[0], ()).fits[0].metrics[0]
    assert row.relative_floor == pytest.approx(15.0 / (row.rmse / row.nrmse))


def test_bound_is_the_nearer_one():
    about = {"name": "n", "bound_low": 1.0, "bound_high": 10.0}
    assert Quantity(value=9.9999, at_bound=True, **about).bound == 10.0
    assert Quantity(value=1.0, at_bound=True, **about).bound == 1.0
    assert Quantity(value=5.0, **about).bound is None


def test_all_inputs_are_watched(coil):
    names = [p.name for p in input_files(coil[0], ["boucwen-flux.pso-fmin"])]
    assert names == ["fit.json", "residuals.parquet", "ingest.json", "flux.json", "segments.parquet"]
