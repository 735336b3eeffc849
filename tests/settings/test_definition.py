"""An option is defined in one place: the command, the pipeline file, Python and the report follow from it."""

import ast
import importlib
import inspect
import json
import pkgutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, fields, is_dataclass, make_dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import pytest
import typer
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from typer.testing import CliRunner

import mrfit
import mrfit.fit.stage
import mrfit.settings
from mrfit.api.options import check_names, settings_of, with_options
from mrfit.cli import main
from mrfit.cli.config import made_of, table_of
from mrfit.cli.options import Only, _default, options, value_of
from mrfit.core.setting import UNSET, Setting, defined, flag_of, key_of
from mrfit.errors import ConfigError
from mrfit.io.faults import plain_fault
from mrfit.io.schemas import stages as stored_stages
from mrfit.io.schemas.reading import of_json
from mrfit.report.page import changes
from mrfit.settings import compare, discover, fit, flux, ingest, report, segment
from mrfit.settings.forms import LIMITS, NAMES, NUMBERS, SIZE, Limits, Names, Pairs

PACKAGE = Path(mrfit.__path__[0])
ALL = [compare.CompareOptions, *(stage.Settings for stage in (discover, fit, flux, ingest, report, segment))]
DEPTH = Annotated[float, Setting("How deep it looks.", flag="deep", short="-d", low=0.5, high=8.0)]
# Settings of a fit with one field more, which nothing else in the package knows of
Extended: Any = make_dataclass("Extended", [("depth", DEPTH, field(default=2.0))], bases=(fit.Settings,), frozen=True)


def command_of(kind: Any, got: list[Any], only: tuple[str, ...] | None = None) -> Callable[..., None]:
    def command(settings: Any) -> None:
        """Keep what it was called with."""
        got.append(settings)

    command.__annotations__["settings"] = kind if only is None else Annotated[kind, Only(only)]
    return options()(command)


def called(kind: Any, *arguments: str, only: tuple[str, ...] | None = None) -> tuple[Any, Any]:
    """Run a command that takes settings of a kind; return what it got and typer's result."""
    app, got = typer.Typer(), list[Any]()
    app.command()(command_of(kind, got, only))
    done = CliRunner().invoke(app, arguments)
    return (got or [None])[0], done


def test_a_field_that_is_added_is_an_option_a_key_an_argument_and_a_line_of_the_report() -> None:
    # option
    shown = called(Extended, "--help")[1].output
    assert "--deep" in shown and "How deep it looks." in shown and "0.5<=x<=8.0" in shown and "2.0" in shown
    assert called(Extended, "--model", "tanh", "--deep", "3", "-j", "1")[0] == Extended("tanh", depth=3.0)
    assert called(Extended, "--model", "tanh", "-d", "3")[0].depth == 3.0
    assert called(Extended, "--model", "tanh", "--deep", "9")[1].exit_code == 2
    # key of a pipeline file
    table = table_of(Extended)
    assert made_of(Extended, table(model="tanh", deep=3)) == Extended("tanh", depth=3.0)
    with pytest.raises(ValidationError) as wrong:
        table(model="tanh", deep=9)
    assert plain_fault(wrong.value, table) == "deep takes a number at most 8, not 9"
    # argument in Python, by either name
    for name in ("depth", "deep"):
        check_names((Extended,), {name: 3})
        assert settings_of(Extended, {name: 3}, model="tanh") == Extended("tanh", depth=3.0)
    with pytest.raises(ConfigError, match="depth takes 8 or less, not 9"):
        settings_of(Extended, {"depth": 9}, model="tanh")

    def face(model: str, **options: object) -> None:
        """Fit."""

    with_options(face, (Extended,), ("model",))
    assert inspect.signature(face).parameters["depth"].default == 2.0 and "depth: float = 2.0" in str(face.__doc__)
    # line of the report
    assert (
        changes({"depth": 3.0}, defined(Extended)) == "depth 3.0" and changes({"depth": 2.0}, defined(Extended)) == ""
    )


def test_nothing_of_it_is_there_without_the_field() -> None:
    assert "--deep" not in called(fit.Settings, "--help")[1].output
    assert called(fit.Settings, "--model", "tanh", "--deep", "3")[1].exit_code == 2
    with pytest.raises(ValidationError):
        table_of(fit.Settings)(model="tanh", deep=3)
    with pytest.raises(ConfigError, match="no option 'depth'"):
        check_names((fit.Settings,), {"depth": 3})
    assert changes({"depth": 3.0}, defined(fit.Settings)) == ""


@dataclass(frozen=True)
class Thrown:
    """One field of every way to write a value."""

    word: Annotated[Literal["one", "two"], Setting("w")] = "one"
    count: Annotated[int | None, Setting("c", low=1)] = None
    share: Annotated[float, Setting("s", above=0.0)] = 1.0
    text: Annotated[str, Setting("t")] = ""
    loud: Annotated[bool, Setting("l")] = False
    pairs: Annotated[Pairs, Setting("p", form=NUMBERS)] = ()
    ends: Annotated[Limits, Setting("e", form=LIMITS)] = ()
    names: Annotated[Names, Setting("n", form=NAMES)] = ()
    some: Annotated[Names, Setting("a", form=NAMES)] = ("a", "b")
    size: Annotated[float | None, Setting("z", form=SIZE)] = None
    jobs: Annotated[int, Setting("j", command_default=7, changes_result=False)] = 1
    inner: int = 5


numbers = st.floats(-1e6, 1e6)
words = st.text("abcxyz", min_size=1, max_size=5)


@settings(deadline=None)
@given(
    st.builds(
        Thrown,
        word=st.sampled_from(["one", "two"]),
        count=st.none() | st.integers(1, 10**9),
        share=st.floats(1e-9, 1e9),
        text=st.text("abc ", max_size=4),
        loud=st.booleans(),
        pairs=st.dictionaries(words, numbers, max_size=3).map(lambda d: tuple(d.items())),
        ends=st.dictionaries(words, numbers, max_size=3).map(lambda d: tuple((n, v, v + 1.0) for n, v in d.items())),
        names=st.lists(words, max_size=3).map(tuple),
        size=st.none() | st.integers(1, 10**12).map(float),
    )
)
def test_the_same_settings_come_from_a_command_a_file_and_python(wanted: Thrown) -> None:
    written = [f"--word={wanted.word}", f"--share={wanted.share!r}", f"--text={wanted.text}", "--jobs=1"]
    written += [f"--count={wanted.count}"] * (wanted.count is not None) + ["--loud"] * wanted.loud
    written += [f"--pairs={n}={v!r}" for n, v in wanted.pairs]
    written += [f"--ends={n}={low!r}:{high!r}" for n, low, high in wanted.ends]
    written += [f"--names={','.join(wanted.names)}", *([f"--size={wanted.size:.0f}"] if wanted.size else [])]
    got, done = called(Thrown, *written)
    assert got == wanted, done.output
    plain = {n: getattr(wanted, n) for n in ("word", "share", "text", "loud")}
    tables = {"pairs": dict(wanted.pairs), "ends": {n: (low, high) for n, low, high in wanted.ends}}
    keys = {**plain, **tables, "names": list(wanted.names)}
    keys |= {"count": wanted.count} if wanted.count else {}
    keys |= {"size": f"{wanted.size:.0f}B"} if wanted.size else {}
    assert made_of(Thrown, table_of(Thrown)(**keys)) == wanted
    assert (
        settings_of(Thrown, {**plain, **tables, "names": wanted.names, "count": wanted.count, "size": wanted.size})
        == wanted
    )


def test_what_is_not_written_is_at_its_default() -> None:
    assert called(Thrown)[0] == Thrown(jobs=7)
    assert called(Thrown, only=("text",))[0] == Thrown()
    assert called(Thrown, "--word", "two", only=("text",))[1].exit_code == 2
    assert made_of(Thrown, table_of(Thrown)()) == settings_of(Thrown, {}) == Thrown()


def test_what_is_for_programs_alone_is_no_option_and_no_key() -> None:
    assert called(Thrown, "--inner", "3")[1].exit_code == 2
    # nor is a key what changes no result
    assert set(table_of(Thrown).model_fields) == {f.name for f in fields(Thrown)} - {"inner", "jobs"}
    assert settings_of(Thrown, {"inner": 3}).inner == 3


@pytest.mark.parametrize(
    ("argument", "message"),
    [
        ("--word=six", "--word takes one or two, not 'six'"),
        ("--pairs=x", "--pairs takes NAME=VALUE, not 'x'"),
        ("--ends=x=1", "--ends takes NAME=LOW:HIGH, not 'x=1'"),
        ("--size=x", "--max-memory takes a size such as 500MB or 2GB, not 'x'"),
    ],
)
def test_a_wrong_value_is_told_by_the_options_name(argument: str, message: str) -> None:
    error = called(Thrown, argument)[1].exception
    assert isinstance(error, ConfigError) and str(error) == message


@pytest.mark.parametrize("number", [float("nan"), float("inf")])
def test_a_number_that_is_not_finite_is_refused_without_limits_too(number: float) -> None:
    assert Setting("s").refusal("--skew", number) == f"--skew takes a finite number, not {number:g}"
    assert Setting("s").refusal("--skew", -1.5) == ""


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("word", "six", "word takes 'one' or 'two', not 'six'"),
        ("count", 0, "count takes 1 or more, not 0"),
        ("count", 1.5, "count takes a whole number, not 1.5"),
        ("share", 0, "share takes a number above 0, not 0"),
        ("share", "much", "share takes a number, not 'much'"),
        ("share", float("nan"), "share: nan is not finite"),
        ("loud", "yes", "loud takes True or False, not 'yes'"),
        ("text", 3, "text takes text, not 3"),
        ("names", 3, "names takes names, not 3"),
    ],
)
def test_a_wrong_argument_is_told_by_its_name(name: str, value: object, message: str) -> None:
    with pytest.raises(ConfigError) as error:
        settings_of(Thrown, {name: value})
    assert str(error.value) == message


@pytest.mark.parametrize("kind", ALL, ids=lambda k: str(k.__module__))
def test_every_setting_says_what_it_is(kind: Any) -> None:
    offered = [f for f in defined(kind) if f.setting]
    assert offered
    for one in offered:
        assert one.setting and one.setting.help.endswith((".", "SECONDS.")) and len(one.setting.help) < 200, one.name
    for named in (flag_of, key_of):
        assert len({named(f) for f in offered}) == len(offered)
    assert [f.name for f in defined(kind) if f.default is UNSET] in ([], ["model"])


def test_a_comparison_has_the_options_of_a_fit_but_for_its_name_and_intervals() -> None:
    fit_own, asked = ({f.name for f in fields(kind)} for kind in (fit.Settings, compare.CompareOptions))
    own = {"name", "intervals", "forms", "driven_by", "mass"}
    assert fit_own - asked == own, f"add to CompareOptions, or list here: {sorted((fit_own - asked) ^ own)}"
    same = {f.name: f.setting for f in defined(fit.Settings)}
    for one in defined(compare.CompareOptions):
        assert one.name in ("models", "optimizers", "model", "seeds", "optimizer") or one.setting is same[one.name]
    wanted = compare.CompareOptions(optimizers=("lsq",), model="tanh", seed=3, seeds=2, budget=9, fixed=(("c", 1.0),))
    inner = fit.Settings("tanh", per="all", budget=9, fixed=(("c", 1.0),))
    assert wanted.of_optimizers == compare.OfOptimizers(("lsq",), inner, 2)
    assert compare.CompareOptions(models=("tanh",), seed=3).of_models == compare.Settings(("tanh",), seed=3)


def test_no_command_says_again_what_settings_define() -> None:
    """The commands' module names no default, help or limit of a setting."""
    tree = ast.parse((PACKAGE / "cli" / "main.py").read_text())
    texts = {n.value for n in ast.walk(tree) if isinstance(n, ast.Constant) and isinstance(n.value, str)}
    for kind in ALL:
        for one in defined(kind):
            assert not one.setting or one.setting.help not in texts, one.name
    functions = [f for f in ast.walk(tree) if isinstance(f, ast.FunctionDef)]
    parameters = [a for f in functions for a in (*f.args.args, *f.args.kwonlyargs)]
    common = [a for a in parameters if a.arg in ("work", "as_json", "jobs", "settings")]
    assert len(common) >= 20
    for function in functions:
        named = zip(function.args.kwonlyargs, function.args.kw_defaults, strict=True)
        # `mrfit run --work` has no default: the file's holds
        assert function.args.defaults == [] or function.name == "root"
        assert all(d is None for a, d in named if a in common and (function.name, a.arg) != ("run", "work"))


def test_the_stages_own_settings_are_those() -> None:
    assert mrfit.fit.stage.Settings is fit.Settings
    assert list(inspect.signature(main.fit).parameters)[:2] == ["model", "opt"]


@pytest.mark.parametrize("command", ["ingest", "fit", "compare", "run", "report"])
def test_help_loads_no_numbers(command: str) -> None:
    code = f"""
import sys
sys.argv = ['mrfit', {command!r}, '--help']
from mrfit.cli.main import app
try:
    app(standalone_mode=False)
finally:
    heavy = {{'numpy', 'pandas', 'numba', 'scipy', 'matplotlib'}} & set(sys.modules)
    print(sorted(heavy), file=sys.stderr)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.splitlines()[-1] == "[]" and "Usage" in done.stdout


@pytest.mark.parametrize(
    ("kind", "stored"),
    [(flux.Settings, stored_stages.FluxSettings), (segment.Settings, stored_stages.SegmentSettings)],
)
def test_what_a_stage_stores_of_its_settings_is_all_of_them(kind: Any, stored: Any) -> None:
    assert asdict(stored()) == asdict(kind())
    told = {f.name: f.default for f in fields(kind)}
    assert asdict(of_json(stored, json.dumps(told))) == told
    with pytest.raises(ValidationError):
        of_json(stored, json.dumps({**told, "other": 1}))


MODULES = [
    importlib.import_module(f"mrfit.settings.{one.name}") for one in pkgutil.iter_modules(mrfit.settings.__path__)
]
CLASSES = {
    kind for module in MODULES for kind in vars(module).values() if isinstance(kind, type) and is_dataclass(kind)
}


@pytest.mark.parametrize("kind", sorted(CLASSES, key=str), ids=lambda kind: f"{kind.__module__}.{kind.__name__}")
def test_the_option_of_every_default_is_read_as_that_default(kind: Any) -> None:
    for one in defined(kind):
        if one.setting and one.default is not UNSET and one.setting.command_default is UNSET:
            assert value_of(one, _default(one)) == one.default, one.name
