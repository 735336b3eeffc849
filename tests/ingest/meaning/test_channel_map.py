from pathlib import Path

import pytest

from mrfit.errors import ConfigError
from mrfit.ingest.meaning.channel_map import Rules, load_map, rules_for

MAP = """
resistance = 2.1
rate = 200
pattern = "{current:A}A"
ignore = ["spare"]
condition = {temperature = 25.0}
[channels]
current = {column = "CH1", scale = 10.0, unit = "A", offset = 0.5, sign = -1}
[[files]]
match = "me5mm*"
dt = 0.001
time = {column = 0, unit = "ms"}
[files.channels]
voltage = {column = 2}
"""


def _write(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "mrfit.toml"
    path.write_text(text)
    return path


def test_general_keys_and_those_of_a_matching_pattern(tmp_path: Path) -> None:
    loaded = load_map(_write(tmp_path, MAP))
    general = rules_for(Path("x/other.csv"), loaded, "map")
    assert general.dt == 0.005
    assert general.resistance == 2.1
    assert general.time is None
    assert set(general.channels) == {"current"}
    special = rules_for(Path("x/ME5mm4Hz.txt"), loaded, "map")
    assert special.dt == 0.001
    assert special.time is not None and special.time.unit == "ms"
    assert set(special.channels) == {"current", "voltage"}
    assert special.channels["current"].sign == -1


def test_no_map_says_nothing() -> None:
    assert rules_for(Path("a.csv"), None, "") == Rules()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("resistence = 2", "unknown key 'resistence'; did you mean 'resistance'"),
        ("[channels]\ncurrent = {colum = 1}", "unknown key 'channels.current.colum'; did you mean 'column'"),
        ("[channels]\ncurrent = {unit = 'A'}", "key 'channels.current.column': field required"),
        ("[channels]\ncurrent = {column = 1, sign = 2}", "key 'channels.current.sign'"),
        ("[channels]\ncurrrent = {column = 1}", "unknown channel 'currrent'; did you mean 'current'"),
        ("[channels]\ntime = {column = 1}", "time is no channel"),
        ("resistance = -1", "key 'resistance': input should be greater than 0 (got -1)"),
        ("dt = 0.1\nrate = 10", "both dt and rate"),
        ("dt = nan", "key 'dt'"),
        ("dt = ", "is not valid TOML"),
        (
            "[channels]\nvoltage = 'CH1'",
            "key 'channels.voltage' takes a table, not \"CH1\"; write voltage = {column = ",
        ),
        ("[[files]]\nmatch = 'a'\nchannels = {voltage = 1}", "takes a table, not 1; write voltage = {column = 1}"),
        ("channels = 'CH1'", "key 'channels' takes a table, not \"CH1\"; write [channels]"),
        ("[channels]\nvoltage = {column = 1, scale = 0}", "key 'channels.voltage.scale' is 0"),
        ("[[files]]\nmatch = 'a'\nchannels = {voltage = {column = 1, scale = 0.0}}", "'channels.voltage.scale' is 0"),
        ("time = 'T'\n[channels]\nforce = {column = 'T'}", "'time' and 'channels.force' both name column 'T'"),
        ("time = {column = 2}\n[channels]\nforce = {column = 2}", "'time' and 'channels.force' both name column 2"),
    ],
)
def test_faults_name_the_key(text: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError) as error:
        load_map(_write(tmp_path, text))
    assert message in str(error.value)
    assert "mrfit.toml" in str(error.value)
    assert "\n" not in str(error.value)


def test_missing_map(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="No such file.*a channel map"):
        load_map(tmp_path / "none.toml")
