"""The file that makes a model of a foreign function: what it says, and each thing that may be wrong with it."""

from pathlib import Path

import pytest

from mrfit.core.foreign import description
from mrfit.core.foreign.description import read_model
from mrfit.core.specs import ModelSpec
from mrfit.errors import ConfigError

TEXT = """
name = "two-lines"
inputs = ["velocity"]
output = "force"
linear = ["fy"]

[c]
library = "two_lines.so"
function = "two_lines"

[parameters.fy]
unit = "N"
low = 1.0
high = 1e4
start = 500.0
scale = "log"
role = "yield"

[parameters.c]
unit = "N*s/m"
low = 0.0
high = 1e5
start = 10.0
fixed = true
"""


@pytest.fixture
def made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[tuple[object, ...]]:
    """Return what is called for, in place of libraries."""
    calls: list[tuple[object, ...]] = []
    monkeypatch.setattr(description, "c_function_model", lambda *given: calls.append(("c", *given)))
    monkeypatch.setattr(description, "fmu_model", lambda *given: calls.append(("fmu", *given)))
    monkeypatch.chdir(tmp_path)
    return calls


def test_its_spec_is_that_of_the_file_and_the_library_lies_beside_it(made: list[tuple[object, ...]]) -> None:
    Path("inner").mkdir()
    Path("inner/model.toml").write_text(TEXT)
    read_model(Path("inner/model.toml"))
    ((kind, spec, library, function),) = made
    assert (kind, library, function) == ("c", Path("inner/two_lines.so"), "two_lines")
    assert isinstance(spec, ModelSpec) and spec.title == "two-lines"
    assert spec.names == ("fy", "c") and spec.linear == ("fy",) and spec.inputs == ("velocity",)
    first, second = spec.params
    assert (first.scale, first.role, first.start, first.fixed) == ("log", "yield", 500.0, False)
    assert (second.scale, second.unit, second.fixed) == ("linear", "N*s/m", True)


def test_an_fmu_has_its_own_names_of_channels(made: list[tuple[object, ...]]) -> None:
    fmu = '[fmu]\nfile = "a.fmu"\nvariables = {velocity = "v"}\n'
    head, _, rest = TEXT.partition("[c]")
    Path("m.toml").write_text(head + fmu + rest[rest.index("[parameters.fy]") :])
    read_model(Path("m.toml"))
    assert made[0][0] == "fmu" and made[0][2:] == (Path("a.fmu"), {"velocity": "v"})


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('name = "two-lines"', "", "the key name is missing"),
        ('output = "force"', 'output = "force"\ncolour = 1', "unknown key colour"),
        ('inputs = ["velocity"]', "inputs = []", "inputs: list should have at least 1 item"),
        ('scale = "log"', 'scale = "cubic"', "parameters.fy.scale: input should be 'linear' or 'log' (got 'cubic')"),
        ("low = 1.0", 'low = "much"', "parameters.fy.low: input should be a valid number"),
        ("low = 1.0", "low = 600.0", "[parameters.fy] needs low < high, start between them and low > 0"),
        ("low = 1.0", "low = 0.0", "[parameters.fy] needs low < high, start between them and low > 0"),
        ("high = 1e5", "high = -1.0", "[parameters.c] needs low < high, start between them (low 0.0"),
        ('linear = ["fy"]', 'linear = ["k"]', "linear names 'k', which is no parameter"),
        ("[c]", '[fmu]\nfile = "a.fmu"\n[c]', "needs either a [c] or an [fmu] table"),
        ("[parameters.fy]", "[parameters.fy", "is not valid TOML"),
    ],
)
def test_a_wrong_file_says_what_is_wrong(
    old: str, new: str, said: str, made: list[tuple[object, ...]], tmp_path: Path
) -> None:
    assert old in TEXT
    Path("m.toml").write_text(TEXT.replace(old, new, 1))
    with pytest.raises(ConfigError) as found:
        read_model(Path("m.toml"))
    assert str(found.value).startswith("m.toml: ") and said in str(found.value) and not made


def test_a_file_without_a_library_says_what_it_needs(made: list[tuple[object, ...]]) -> None:
    head, _, rest = TEXT.partition("[c]")
    Path("m.toml").write_text(head + rest[rest.index("[parameters.fy]") :])
    with pytest.raises(ConfigError, match="needs either a"):
        read_model(Path("m.toml"))
    Path("m.toml").write_bytes(b'name = "\xff"')
    with pytest.raises(ConfigError, match="is not valid TOML"):
        read_model(Path("m.toml"))
