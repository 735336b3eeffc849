import numpy as np
import pytest

from mrfit.ingest.containers.arrays import Arrays
from mrfit.ingest.containers.labels import labels_of
from mrfit.ingest.readers.matlab import told_by_headers

PAIR = ["data[0]", "data[1]"]
NAMES, UNITS = ["Stroke", "Load"], ["mm", "N"]


@pytest.mark.parametrize(
    ("signals", "names", "units"),
    [
        (PAIR, "labels", "units"),
        (PAIR, "Channel Names", "channel_units"),
        (PAIR, "chan_names", "chan_units"),
        (PAIR, "sigLabels", "sigUnits"),
        (PAIR, "data.columns", "data.units"),
        (["run.data[0]", "run.data[1]"], "run.colheaders", ".units"),
        (["df.block0_values[0]", "df.block0_values[1]"], "df.block0_items", "df.units"),
    ],
)
def test_lists_beside_a_matrix_name_its_columns(signals: list[str], names: str, units: str) -> None:
    found = labels_of(signals, {names: NAMES, units: UNITS})
    assert found == (dict(zip(signals, NAMES, strict=True)), dict(zip(signals, UNITS, strict=True)))


@pytest.mark.parametrize(
    "lists",
    [
        {"labels": ["Stroke", "Load", "Current"]},
        {"comments": NAMES},
        {"filenames": NAMES},
        {"other.labels": NAMES},
        {"block0_items": NAMES},
    ],
)
def test_other_lists_do_not(lists: dict[str, list[str]]) -> None:
    assert labels_of(PAIR, lists) == ({}, {})


def test_the_nearest_list_holds_and_of_two_the_one_with_known_names() -> None:
    lists = {"labels": ["a", "b"], "run.channels": ["ai0", "ai1"], "run.labels": NAMES}
    assert list(labels_of(["run.x[0]", "run.x[1]"], lists)[0].values()) == NAMES


@pytest.mark.parametrize("name", ["Channel_1_Data", "Channel_1_Values"])
def test_headers_of_catman_tell_of_their_channel(name: str) -> None:
    arrays = Arrays({name: np.arange(9.0)})
    head = {"SignalName": "Weg", "Unit": "mm", "SampleFrequency": "1200"}
    arrays.texts = {f"Channel_1_Header.{k}": text for k, text in head.items()} | {"File_Header.SampleFrequency": "2400"}
    told_by_headers(arrays)
    if name.endswith("_Data"):
        assert (arrays.labels, arrays.units) == ({name: "Weg"}, {name: "mm"})
        assert arrays.texts[f"{name}.SampleFrequency"] == "1200"
        assert "File_Header.SampleFrequency" not in arrays.texts
    else:
        assert not arrays.labels and not arrays.units and len(arrays.texts) == 4
