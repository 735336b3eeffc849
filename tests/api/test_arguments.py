"""A value of a wrong type, for any argument of any public function, ends in one line that names the argument."""

import importlib
import inspect
from collections.abc import Callable, Iterator, Mapping
from decimal import Decimal
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import mrfit
from mrfit.core.arguments import check_arguments, is_of

TIME = np.arange(60) * 0.05
WAVE = np.sin(2.0 * np.pi * TIME)
SCALARS: list[Any] = [
    *(None, True, -1, 0, 3, 10**400, -1.5, float("nan"), float("inf"), 1j, "", "text", "\0", b"x", bytearray(b"a")),
    *(np.float32(1.5), np.int64(3), np.str_("a"), np.array(3.0), np.datetime64("2024"), pd.NA, pd.NaT, Decimal("1")),
    *(object(), Ellipsis, Path("nowhere"), memoryview(b"ab"), pd.Timestamp("2024")),
]
WHOLES: list[Any] = [
    *(np.array([1.0, 2.0]), np.array([["a"]]), np.array([], dtype=object), pd.Series([1.0]), pd.DataFrame()),
    *(range(3), [[1, 2], [3]], {1: 2}, {"force": None}, {"force": "kN"}, {"a": {"b": 1}}, np.ma.masked_all(3)),
]
COIL = mrfit.apply.coil("boucwen-mmf", {"L": 0.03, "i_c": 0.1, "flux_y": 0.003, "n": 1.3, "rho": -0.3})
Call = tuple[Callable[..., object], dict[str, Any]]


def _values() -> st.SearchStrategy[Any]:
    one = st.sampled_from(SCALARS)
    key = st.sampled_from(["force", "fy", "", "a", 1, None])
    known = [v for v in SCALARS if v.__hash__ is not None and not isinstance(v, memoryview)]
    held = st.one_of(st.lists(one, max_size=2), st.dictionaries(key, one, max_size=2), st.tuples(one, one))
    return st.one_of(one, st.sampled_from(WHOLES), held, st.sets(st.sampled_from(known), max_size=2))


@pytest.fixture(scope="module")
def calls(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Call]:
    """Sound calls by name; those that would compute long have no recordings and end there."""
    folder = tmp_path_factory.mktemp("door")
    recording = mrfit.Recording
    log = recording.from_arrays(dt=0.05, displacement=WAVE, velocity=np.gradient(WAVE, TIME), force=300.0 * WAVE)
    fit = mrfit.fit(log, "bingham", progress=False, optimizer="lsq", budget=50)
    fit.save(folder / "fit.json")
    rows = "".join(f"{t:.4f},{f:.3f}\n" for t, f in zip(TIME, WAVE, strict=True))
    (folder / "a.csv").write_text("time (s),force (N)\n" + rows)
    table = pd.DataFrame({"log": list("abcdefgh"), "parameter": "fy", "value": np.arange(8.0)})
    table["low"], table["high"] = table["value"] - 1.0, table["value"] + 1.0
    sheet, found, applied = mrfit.sheet(log, progress=False), fit.predict(log, progress=False), mrfit.apply
    known = {"fy@0A": 75.0, "fy@1A": 963.0, "C_inf": 962.0, "f0": 0.0}
    return {
        "from_arrays": (recording.from_arrays, {"dt": 2e-3, "force": WAVE, "displacement": WAVE}),
        "from_frame": (recording.from_frame, {"frame": pd.DataFrame({"time": TIME, "force": WAVE})}),
        "from_frame, dt": (recording.from_frame, {"frame": pd.DataFrame({"force": WAVE}), "dt": 0.05}),
        "read": (mrfit.read, {"paths": folder / "a.csv", "progress": False}),
        "load": (mrfit.load, {"path": folder / "fit.json"}),
        "fit": (mrfit.fit, {"recordings": [], "model": "tanh"}),
        "discover": (mrfit.discover, {"recordings": [], "model": "tanh"}),
        "compare": (mrfit.compare, {"recordings": []}),
        "compare optimizers": (mrfit.compare, {"recordings": [], "optimizers": "lsq", "model": "tanh"}),
        "predict": (mrfit.predict, {"fit": fit, "recordings": []}),
        "advise": (mrfit.advise, {"found": fit, "recordings": [], "rig": {"seconds": 1, "stroke": "10 mm"}}),
        "sheet": (mrfit.sheet, {"recordings": log, "progress": False}),
        "drift": (mrfit.drift, {"results": table}),
        "model": (mrfit.model, {"name": "own", "inputs": ("velocity",), "output": "force", "params": ()}),
        "Param": (mrfit.Param, {"name": "a", "unit": "N", "low": 0.0, "high": 1.0, "start": 0.5}),
        "FitResult.predict": (fit.predict, {"recordings": []}),
        "FitResult.plot": (fit.plot, {}),
        "FitResult.save": (fit.save, {"path": folder / "again.json"}),
        "FitResult.export": (fit.export, {"folder": folder / "out", "to": "json", "recordings": []}),
        "Prediction.plot": (found.plot, {}),
        "Sheet.plot": (sheet.plot, {}),
        "Sheet.save": (sheet.save, {"folder": folder / "sheet"}),
        "invert": (applied.invert, {"fit": None, "motion": log}),
        "track parameters": (mrfit.track, {"fit": fit, "recordings": [], "parameters": ["fy"]}),
        "track": (applied.track, {"fit": fit, "motions": [], "laws": "c=1e3"}),
        "quarter_car": (applied.quarter_car, {"fit": None}),
        "damper": (applied.damper, {"model": "bingham", "parameters": known, "orders": {"fy": 1}}),
        "road": (applied.road, {"text": "A"}),
        "sine": (applied.sine, {"frequency": 1.0, "amplitude": 0.01}),
        "Amplifier": (applied.Amplifier, {}),
        "Car": (applied.Car, {}),
        "Control": (applied.Control, {"name": "skyhook"}),
        "Timing": (applied.Timing, {}),
    }


def _arguments(call: Call) -> list[str]:
    """Return the arguments of a call; a file that a junk path would make is none of the property."""
    function, given_values = call
    kinds = inspect.signature(function).parameters
    whole = [n for n, p in kinds.items() if p.kind not in (p.VAR_KEYWORD, p.VAR_POSITIONAL)]
    return [n for n in dict.fromkeys([*whole, *given_values]) if n not in ("path", "folder", "paths")]


def _ends_in_one_line(call: Call, argument: str, value: object) -> None:
    function, sound = call
    try:
        function(**{**sound, argument: value})
    except mrfit.MrfitError as error:
        assert "\n" not in str(error)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("number", [800, pytest.param(5000, marks=pytest.mark.slow)])
def test_no_value_ends_in_an_error_of_python(calls: dict[str, Call], number: int) -> None:
    places = [(name, argument) for name, call in calls.items() for argument in _arguments(call)]

    @settings(
        max_examples=number, deadline=None, derandomize=True, database=None, suppress_health_check=list(HealthCheck)
    )
    @given(place=st.sampled_from(places), value=_values())
    def holds(place: tuple[str, str], value: object) -> None:
        name, argument = place
        _ends_in_one_line(calls[name], argument, value)

    holds()


@pytest.mark.parametrize("value", [[1], {1, 2}, 3, "\0", b"x", None, np.array([1.0])])
@pytest.mark.parametrize("argument", ["path", "folder", "paths"])
def test_no_path_of_a_wrong_type_ends_in_an_error_of_python(
    calls: dict[str, Call], argument: str, value: object
) -> None:
    for function, sound in calls.values():
        if argument in inspect.signature(function).parameters:
            with pytest.raises(mrfit.MrfitError, match=f"{argument} takes str") as error:
                function(**{**sound, argument: value})
            assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("value", "kind", "fits"),
    [
        *((v, float, True) for v in (1, 2.5, True, np.float32(1.5), np.int8(3), np.array(2.0), Decimal("0.1"))),
        *((v, float, False) for v in ("2", b"2", 1j, None, [1.0], 10**400, np.array([1.0, 2.0]))),
        *((v, int, True) for v in (1, np.int64(2))),
        *((v, int, False) for v in (1.0, np.float64(1.0), "1")),
        *((v, bool, True) for v in (True, np.True_)),
        *((v, str | None, True) for v in ("a", np.str_("a"), None)),
        *((v, str, False) for v in (b"a", "a\0", Path("a"))),
        *((v, Mapping[str, float] | None, True) for v in ({}, {"a": 1}, None)),
        *((v, Mapping[str, float], False) for v in ([1], {"a": "1"}, {1: 1.0}, [("a", 1.0)])),
        *((v, Iterator[str], True) for v in (iter("ab"),)),
        *((v, list[str], False) for v in ("ab", [1], 3)),
        (("a", 1), tuple[str, int], True),
        (("a",), tuple[str, int], False),
        ("a", Literal["a", "b"], True),
        (["a"], Literal["a", "b"], False),
        (len, Callable[[str], int], True),
        ("len", Callable[[str], int], False),
        (1.0, Annotated[float, "seconds"], True),
        (object(), Any, True),
    ],
)
def test_a_value_is_of_an_annotation(value: object, kind: object, fits: bool) -> None:
    assert is_of(value, kind) == fits


def test_a_stream_is_left_to_what_it_is_given_to() -> None:
    @check_arguments
    def joined(words: "Iterator[str] | list[str]", *, often: int = 1) -> str:
        return often * "".join(words)

    assert joined(iter(["a", "b"]), often=2) == "abab"
    with pytest.raises(mrfit.ConfigError, match="often takes int, not '2'"):
        joined([], often="2")  # type: ignore[arg-type]
    with pytest.raises(mrfit.ConfigError, match=r"words takes Iterator\[str\] \| list\[str\], not \[1\]"):
        joined([1])  # type: ignore[list-item]
    with pytest.raises(TypeError, match="words"):
        joined()  # type: ignore[call-arg]


def test_a_function_of_a_room_is_none_of_its_modules() -> None:
    assert callable(mrfit.apply.invert) and callable(mrfit.apply.sine)
    importlib.import_module("mrfit.apply.damper")
    assert inspect.isfunction(mrfit.apply.damper)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: mrfit.apply.current_of_flux(COIL, WAVE, 0.0), "dt takes a number above 0, not 0"),
        (lambda: mrfit.apply.flux_command(COIL, WAVE, -1.0, mrfit.apply.CoilDrive(2.0)), "dt takes a number above 0"),
        (lambda: mrfit.apply.flux_command(COIL, WAVE, float("inf"), mrfit.apply.CoilDrive(2.0)), "dt takes a finite"),
        (lambda: mrfit.apply.CoilDrive(resistance=float("nan")), "resistance takes a finite number, not nan"),
        (lambda: mrfit.apply.CoilDrive(resistance=-1.0), "resistance takes 0 or more, not -1"),
        (lambda: mrfit.apply.road("bump", speed=-3.0), "speed takes a number above 0, not -3"),
        (lambda: mrfit.apply.road("C", duration=0), "duration takes a number above 0, not 0"),
        (lambda: mrfit.apply.damper("bingham", {"fy": float("nan"), "C_inf": 9.0, "f0": 0.0}), "fy: nan is not finite"),
    ],
)
def test_a_number_beyond_its_limits_is_one_line_that_names_it(call: Callable[[], object], said: str) -> None:
    with pytest.raises(mrfit.ConfigError, match=said):
        call()
