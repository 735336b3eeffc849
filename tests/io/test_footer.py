"""Metadata of Parquet files read without pyarrow: what pyarrow reads, and one kind of error for what is damaged."""

from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mrfit.io.footer import written_text

# as a text of JSON has them: control characters are escaped
TEXTS = st.dictionaries(
    st.text(st.characters(exclude_categories=["Cc", "Cs"]), min_size=1, max_size=20),
    st.text(st.characters(exclude_categories=["Cc", "Cs"]), max_size=300),
    max_size=20,
)
TABLES = {
    "numbers": pa.table({"x": [1.0, 2.5, None], "k": [1, 2, 3], "yes": [True, False, None]}),
    "nested": pa.table({"a": [[1, 2], [], None], "b": [{"c": 1, "d": "ä"}, None, {"c": None, "d": ""}]}),
    "empty": pa.table({"x": pa.array([], pa.float64())}),
    "many columns": pa.table({f"c{k}": [float(k)] * 40 for k in range(40)}),
}


@pytest.mark.parametrize("kind", TABLES)
@pytest.mark.parametrize("group", [1, 1000])
def test_the_texts_are_those_that_were_written(kind: str, group: int, tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    about = {"mrfit": "Größe: λ₀", "mrfit.content": 64 * "f", "empty": ""}
    pq.write_table(TABLES[kind].replace_schema_metadata(about), path, row_group_size=group, compression="zstd")
    assert {key: written_text(path, key) for key in about} == about
    assert written_text(path, "mrfit.conten") is None


@settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(TEXTS)
def test_any_texts_come_back(tmp_path: Path, texts: dict[str, str]) -> None:
    path = tmp_path / "a.parquet"
    with pq.ParquetWriter(path, TABLES["numbers"].schema) as writer:
        writer.write_table(TABLES["numbers"])
        writer.add_key_value_metadata(texts)
    assert {key: written_text(path, key) for key in texts} == texts


@settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_a_damaged_footer_ends_in_one_kind_of_error(tmp_path: Path, data: st.DataObject) -> None:
    path = tmp_path / "a.parquet"
    pq.write_table(TABLES["nested"].replace_schema_metadata({"mrfit": "x"}), path)
    content = bytearray(path.read_bytes())
    if data.draw(st.booleans()):
        content[data.draw(st.integers(4, len(content) - 1))] = data.draw(st.integers(0, 255))
    else:
        del content[data.draw(st.integers(0, len(content) - 1)) : data.draw(st.integers(0, len(content)))]
    path.write_bytes(content)
    try:
        found = written_text(path, "mrfit")
    except ValueError:
        return
    assert found is None or isinstance(found, str)


@pytest.mark.parametrize("content", [b"", b"PAR1", b"a text of some length"])
def test_what_is_no_parquet_file_is_said(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    path.write_bytes(content)
    with pytest.raises(ValueError, match="no Parquet file"):
        written_text(path, "mrfit")
