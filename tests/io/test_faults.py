"""A fault in a file is one sentence: which key, what it takes, what is there."""

from dataclasses import dataclass
from typing import Annotated, Literal

import pytest
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from mrfit.io.faults import plain_fault


class Stage(BaseModel):
    model_config = ConfigDict(extra="forbid")

    rule: Literal["trapezoid", "simpson"] = "simpson"
    order: int = 1
    share: Annotated[float, Field(gt=0.0, le=1.0)] = 0.5
    rows: Annotated[float, Field(ge=2.0, lt=8.0)] = 4.0
    on: bool = True
    either: int | float = 1
    word: str | list[str] = ""


class Pipeline(BaseModel):
    model_config = ConfigDict(extra="forbid")

    name: str
    flux: Stage = Stage()
    fit: list[Stage] = []
    map: dict[str, float] = {}
    pair: tuple[float, float] = (0.0, 1.0)
    some: Annotated[list[str], Field(min_length=1, max_length=2)] = ["a"]
    ident: Annotated[str, Field(pattern="^[a-z]+$")] = "a"


def of_toml(**given: object) -> str:
    with pytest.raises(ValidationError) as found:
        Pipeline.model_validate({"name": "a", **given})
    return plain_fault(found.value, Pipeline)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"flux": {"rule": "euler"}}, "[flux] rule takes 'trapezoid' or 'simpson', not 'euler'"),
        ({"flux": {"order": 1.5}}, "[flux] order takes a whole number, not 1.5"),
        ({"flux": {"order": "many"}}, "[flux] order takes a whole number, not 'many'"),
        ({"flux": {"share": 0.0}}, "[flux] share takes a number above 0, not 0.0"),
        ({"flux": {"share": 2.0}}, "[flux] share takes a number at most 1, not 2.0"),
        ({"flux": {"rows": 1.0}}, "[flux] rows takes a number at least 2, not 1.0"),
        ({"flux": {"rows": 9.0}}, "[flux] rows takes a number below 8, not 9.0"),
        ({"flux": {"on": "perhaps"}}, "[flux] on takes true or false, not 'perhaps'"),
        ({"flux": {"either": "x"}}, "[flux] either takes a number, not 'x'"),
        ({"flux": {"word": 5}}, "[flux] word takes text or a list, not 5"),
        ({"flux": 3}, "flux takes a table, not 3"),
        ({"name": None}, "name takes text, not nothing"),
        ({"name": True}, "name takes text, not true"),
        ({"fit": {"order": 1}}, "fit is one table; write [[fit]] for each of several"),
        ({"fit": [{}, {"order": "x"}]}, "[[fit]] 2: order takes a whole number, not 'x'"),
        ({"map": {"a": "x"}}, "[map] a takes a number, not 'x'"),
        ({"pair": [1.0]}, "pair has too few values"),
        ({"some": []}, "some has too few values"),
        ({"some": ["a", "b", "c"]}, "some has too many values"),
        ({"some": ["a", 2]}, "some.1 takes text, not 2"),
        ({"ident": "a b"}, "ident takes a plain name of letters, digits, . _ and -, not 'a b'"),
        ({"name": "x" * 80, "ident": 3}, "ident takes text, not 3"),
    ],
)
def test_a_key_of_a_toml_file_with_what_it_takes(given: dict[str, object], said: str) -> None:
    assert of_toml(**given) == said


def test_a_long_value_is_cut() -> None:
    said = of_toml(ident="A" * 80)
    assert said.endswith("…") and len(said) < 130


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"nam": "b"}, "nam is no key mrfit knows; did you mean 'name'?"),
        ({"flux": {"rul": "x"}}, "[flux] rul is no key mrfit knows; did you mean 'rule'?"),
        ({"fit": [{"ordr": 1}]}, "[[fit]] 1: ordr is no key mrfit knows; did you mean 'order'?"),
        ({"flux": {"zzz": 1}}, "[flux] zzz is no key mrfit knows; it may be one of rule, order, share, rows, on, "),
    ],
)
def test_an_unknown_key_is_told_beside_the_nearest_or_all_there_are(given: dict[str, object], said: str) -> None:
    assert of_toml(**given).startswith(said)


def test_a_missing_key_is_missing_and_an_unknown_one_comes_first() -> None:
    with pytest.raises(ValidationError) as found:
        Pipeline.model_validate({})
    assert plain_fault(found.value, Pipeline) == "name is missing"
    with pytest.raises(ValidationError) as found:
        Pipeline.model_validate({"nam": "a"})
    assert plain_fault(found.value, Pipeline).startswith("nam is no key")


@dataclass
class Sample:
    dt: float


@dataclass
class Log:
    recordings: list[Sample]
    ends: tuple[float, float]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('{"recordings": [{"dt": "x"}], "ends": [0, 1]}', "recordings[0].dt takes a number, not 'x'"),
        ('{"recordings": [{}], "ends": [0, 1]}', "recordings[0].dt is missing"),
        ('{"recordings": [], "ends": [0]}', "ends has too few values"),
        ('{"recordings": 1, "ends": [0, 1]}', "recordings takes a list, not 1"),
        ("[]", "the file takes a table, not []"),
    ],
)
def test_a_place_in_json_is_written_as_programs_do(text: str, said: str) -> None:
    with pytest.raises(ValidationError) as found:
        TypeAdapter(Log).validate_json(text)
    assert plain_fault(found.value) == said


def test_what_is_no_json_is_said_by_what_reads_it() -> None:
    with pytest.raises(ValidationError) as found:
        TypeAdapter(Log).validate_json("{")
    said = plain_fault(found.value)
    assert said.startswith("invalid JSON") and "\n" not in said
