from pathlib import Path

import h5py
import numpy as np

from mrfit.ingest.containers.arrays import Arrays
from mrfit.ingest.containers.hdf import LONGEST_FIXED_TEXT, hdf_arrays
from mrfit.ingest.meaning.channel_map import Rules
from mrfit.ingest.table import Source
from mrfit.ingest.text.head import open_head


def test_datasets_attributes_and_what_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    with h5py.File(path, "w") as file:
        file.attrs["fs"] = 100.0
        file["rig/force"] = np.arange(5.0)
        file["rig/force"].attrs["unit"] = b"kN"
        file["#refs#/x"] = np.arange(5.0)
        file["names"] = np.array([b"a", b"b"])
    arrays = hdf_arrays(Source(open_head(path), Rules()), Arrays())
    assert list(arrays.signals) == ["rig.force"]
    assert arrays.units == {"rig.force": "kN"}
    assert arrays.scalars == {".fs": 100.0}
    assert arrays.lists == {"names": ["a", "b"]}


def test_texts_of_a_few_bytes_that_unpack_to_many_are_left_packed(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    with h5py.File(path, "w") as file:
        file["unit"] = "kN"
        file.create_dataset("note", shape=(1,), dtype=f"S{LONGEST_FIXED_TEXT + 1}", compression="gzip")
        file.create_dataset("names", shape=(1000,), dtype="S8", compression="gzip")
    arrays = hdf_arrays(Source(open_head(path), Rules()), Arrays())
    assert (arrays.texts, arrays.lists) == ({"unit": "kN"}, {})
