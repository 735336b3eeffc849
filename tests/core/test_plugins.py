"""Items from outside the package: found by name, named in a clash, part of keys, and run only if named."""

import os
import re
import subprocess
import sys
import textwrap
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from mrfit.cli import console
from mrfit.core import plugins, registry
from mrfit.core.executors.order import in_processes
from mrfit.core.progress import silent
from mrfit.core.specs import Array, ModelSpec, Param
from mrfit.discover.evidence.bench import effects_for
from mrfit.errors import ConfigError
from mrfit.io.keys import discovery_key, fit_key, plugins_used
from mrfit.kernels.jit import kernel
from mrfit.kernels.theta import columns
from mrfit.simulate.assembly import assemble
from tests.plugin_files import EXAMPLE, install

PARAMS = (Param("c", "N*s/m", 1.0, 1e4, 100.0, text="damping"), Param("n", "1", 0.5, 2.0, 1.0, text="power"))
MODEL = '''
from mrfit.core.plugins import model
from mrfit.core.specs import Param

@model("{name}", ["velocity"], "force", [Param("c", "N*s/m", 1.0, 1e4, 100.0, text="damping")])
def law(drive, theta, dt):
    """A dashpot."""
    return {factor} * theta[:, :1] * drive[0]
'''
DASHPOT = MODEL.format(name="dashpot", factor=1)
SETTINGS = {"model": "dashpot", "optimizer": "auto", "jobs": 1}
Write = Callable[..., Path]


@pytest.fixture(autouse=True)
def store(monkeypatch: pytest.MonkeyPatch) -> None:
    """No plug-ins but those of the test."""
    monkeypatch.setattr(plugins, "_store", plugins.Store())
    monkeypatch.setenv(plugins.VARIABLE, "")


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def written(text: str = MODEL, name: str = "own.py", **words: object) -> Path:
        path = tmp_path / name
        path.write_text(text.format(**({"name": "dashpot", "factor": 1} | words)) if text == MODEL else text)
        return path

    return written


def power_law(drive: Array, theta: Array, dt: float) -> Array:
    """A dashpot of another power than one.

    More of it.
    """
    c, n = columns(theta)
    out: Array = c * np.sign(drive[0]) * np.abs(drive[0]) ** n
    return out


DRIVE = np.linspace(-0.3, 0.4, 50)[None]
THETA = np.array([[100.0, 1.0], [50.0, 1.5]])


def test_a_decorated_function_is_a_model_and_stays_a_function() -> None:
    assert plugins.model("power-law", ["velocity"], "force", PARAMS)(power_law) is power_law
    assert "power-law" in registry.names("model") and "tanh" in registry.names("model")
    whole = assemble("power-law")
    assert whole.spec.title == "A dashpot of another power than one" and whole.spec.caution == ""
    wanted = [c * np.sign(DRIVE[0]) * np.abs(DRIVE[0]) ** n for c, n in THETA]
    np.testing.assert_allclose(whole.simulate(DRIVE, THETA, 1e-3), wanted, rtol=1e-14)


def test_a_function_of_one_vector_gives_the_same_and_the_fit_is_told_that_it_is_slower() -> None:
    def one(drive: Array, theta: Array, dt: float) -> Array:
        c, n = theta
        if np.ndim(n) == 0 and n > 1.9:
            raise ZeroDivisionError
        out: Array = c * np.sign(drive[0]) * np.abs(drive[0]) ** n
        return out

    plugins.model("one-by-one", ["velocity"], "force", PARAMS, batched=False)(one)
    item = registry.load("model", "one-by-one")
    np.testing.assert_allclose(item.response(DRIVE, THETA, 1e-3), power_law(DRIVE, THETA, 1e-3), rtol=1e-14)
    along = np.repeat(THETA[:, :, None], 50, axis=2) * np.linspace(1.0, 1.2, 50)
    np.testing.assert_allclose(item.response(DRIVE, along, 1e-3), power_law(DRIVE, along, 1e-3), rtol=1e-14)
    failed = item.response(DRIVE, np.array([[1.0, 1.95], [1.0, 1.0]]), 1e-3)
    assert np.isnan(failed[0]).all() and np.isfinite(failed[1]).all()
    assert item.SPEC.caution == plugins.ONE_BY_ONE.format("one-by-one")


def test_what_overflows_in_a_decorated_function_is_no_warning() -> None:
    plugins.model("steep", ["velocity"], "force", PARAMS)(
        lambda drive, theta, dt: theta[:, :1] * np.exp(1e6 * drive[0])
    )
    assert np.isinf(registry.load("model", "steep").response(DRIVE, THETA, 1e-3)).any()


def test_a_cell_that_is_run_again_replaces_its_model() -> None:
    for text in ("older", "newer"):
        plugins.model("power-law", ["velocity"], "force", PARAMS, title=text)(power_law)
    assert registry.load("model", "power-law").SPEC.title == "newer"


def test_a_file_is_run_where_it_is_named_and_leaves_nothing_beside_it(write: Write) -> None:
    path = write()
    assert "dashpot" not in registry.names("model")
    plugins.use(path)
    plugins.use(path.parent / "." / path.name)
    assert registry.load("model", "dashpot").SPEC.title == "A dashpot"
    assert [p.name for p in path.parent.iterdir()] == ["own.py"]
    assert registry.where("model", "dashpot") == f"{path}, line 5"
    assert registry.where("model", "tanh") == registry.digest("model", "tanh") == ""


def test_a_file_in_the_form_of_mrfits_own_is_an_item(write: Write) -> None:
    path = write((EXAMPLE / "mrfit_example" / "hardening_spring.py").read_text())
    plugins.use(path)
    assert assemble("tanh+hardening-spring").spec.names[-1] == "hardening-spring.k3"
    assert registry.where("effect", "hardening-spring") == str(path)


def test_files_of_the_environment_are_run(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    paths = [write(), _named(write().parent, "other")]
    monkeypatch.setenv(plugins.VARIABLE, os.pathsep.join(map(str, paths)))
    assert {"dashpot", "other"} <= set(registry.names("model"))


def test_a_name_that_is_taken_names_both_places(write: Write) -> None:
    path, other = write(), write(name="second.py", factor=2)
    plugins.use(path)
    with pytest.raises(ConfigError) as clash:
        plugins.use(other)
    places = f"{path}, line 5 and {other}, line 5"
    assert str(clash.value) == f"two models are called 'dashpot': {places}; rename or leave out one"
    assert registry.where("model", "dashpot") == f"{path}, line 5"
    with pytest.raises(ConfigError) as clash:
        plugins.use(_named(path.parent, "tanh"))
    assert "mrfit itself (mrfit.models.tanh) and" in str(clash.value) and "tanh.py, line 5" in str(clash.value)
    assert assemble("tanh").spec.reference.startswith("inverse-tanh")


def _named(folder: Path, name: str) -> Path:
    path = folder / f"{name}.py"
    path.write_text(MODEL.format(name=name, factor=1))
    return path


def test_one_name_for_two_kinds_is_no_clash(tmp_path: Path) -> None:
    plugins.use(_named(tmp_path, "delay"))
    assert registry.load("model", "delay").SPEC.output == "force"
    assert registry.load("effect", "delay").SPEC.slot


def test_a_name_taken_within_one_file_is_an_error(write: Write) -> None:
    text = MODEL.format(name="dashpot", factor=1)
    with pytest.raises(ConfigError, match=r"own.py, line 5 and .*own.py, line \d+; rename"):
        plugins.use(write(text + text.lstrip("\n") + "\n"))
    assert "dashpot" not in registry.names("model")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("x = 1\ny = 1 / 0\n", r"own.py, line 2: ZeroDivisionError: division by zero; mend the plug-in"),
        ("x = (\n", r"own.py, line 1: SyntaxError: '\(' was never closed; mend"),
        ("raise SystemExit(7)\n", r"own.py, line 1: SystemExit: 7; mend the plug-in"),
        ("import nowhere\n", r"own.py, line 1: ModuleNotFoundError: No module named 'nowhere'; mend"),
        ("x = 1\n", r"own.py: no model, effect, optimizer or reader in it; give it a SPEC"),
        ("SPEC = 1\n", r"own.py: no SPEC; it is a ModelSpec"),
        (
            'from mrfit.core.specs import *\nSPEC = ModelSpec("a b", "", "", "", (), "force", ())\nresponse = print\n',
            r"own.py: the name of the model cannot be 'a b': use small letters",
        ),
        (
            'from mrfit.core.specs import *\nSPEC = OptimizerSpec("a-b", "", "", "local", len)\nminimise = print\n',
            r"own.py: the name of the optimizer cannot be 'a-b': use small letters and digits$",
        ),
        (
            'from mrfit.core.specs import *\nSPEC = ReaderSpec("own", "")\n',
            r"the reader 'own' has no function sniff and read",
        ),
        (
            'from mrfit.core.specs import *\nSPEC = EffectSpec("own", "", "", "", "middle", ("force",), (), (), ())\n',
            r"no slot 'middle'; choose one of input, loop,",
        ),
        (
            'from mrfit.core.specs import *\nSPEC = EffectSpec("own", "", "", "", "add", ("force",), (), (), ())\n',
            r"the effect 'own' has no function term",
        ),
    ],
)
def test_a_wrong_file_ends_in_one_line_and_can_be_mended(write: Write, text: str, told: str) -> None:
    path = write(text)
    with pytest.raises(ConfigError, match=told) as error:
        plugins.use(path)
    assert "\n" not in str(error.value)
    assert plugins.of_files() == []
    plugins.use(write())
    assert "dashpot" in registry.names("model")


def test_what_a_file_prints_is_not_in_the_output(write: Write, capsys: pytest.CaptureFixture[str]) -> None:
    plugins.use(write("print('hello')\n" + DASHPOT))
    printed = capsys.readouterr()
    assert (printed.out, printed.err) == ("", "hello\n")


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("return nothing + state", r"own.py: cannot be compiled: NameError: name 'nothing' is not defined; mend the"),
        ("a, b = (state,)", r"own.py, line 2: cannot be compiled: .*wrong tuple length.*; mend the plug-in"),
    ],
)
def test_a_step_that_cannot_be_compiled_is_one_line(write: Write, line: str, told: str) -> None:
    path = write(f"def step(state):\n    {line}\n\n\n" + DASHPOT)
    plugins.use(path)
    step = sys.modules["mrfit_plugin_own"].step
    with pytest.raises(Exception) as error:  # noqa: PT011  # numba's own
        kernel(step, kept=False)(1.0)
    said, code = console.explain(error.value)
    assert code == 1 and re.search(told, said) and "\n" not in said
    assert plugins.said_by_compiler(ValueError("no error of a compiler")) == ""


@pytest.mark.parametrize(("name", "told"), [("none.py", "cannot be read"), ("own.txt", "give a Python file")])
def test_what_is_no_plugin_file_is_said(write: Write, tmp_path: Path, name: str, told: str) -> None:
    write(name="own.txt")
    with pytest.raises(ConfigError, match=f"{name}: .*{told}"):
        plugins.use(tmp_path / name)


def test_the_source_of_a_plugin_is_part_of_the_keys_that_it_is_used_in(
    write: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    def keys() -> list[str]:
        monkeypatch.setattr(plugins, "_store", plugins.Store())
        plugins.use(tmp)
        own, other = fit_key(SETTINGS, {}, []), fit_key(SETTINGS | {"model": "tanh"}, {}, [])
        return [own, other, discovery_key({"model": "tanh"}, {}, [])]

    tmp = write()
    first, again = keys(), keys()
    write(factor=2)
    edited = keys()
    assert first == again
    assert edited[0] != first[0] and edited[1:] == first[1:]


def test_effects_of_plugins_are_part_of_a_discoverys_key_whatever_its_model(write: Write) -> None:
    before = discovery_key({"model": "tanh"}, {}, []), fit_key({"model": "tanh", "optimizer": "auto"}, {}, [])
    plugins.use(write((EXAMPLE / "mrfit_example" / "hardening_spring.py").read_text()))
    after = discovery_key({"model": "tanh"}, {}, []), fit_key({"model": "tanh", "optimizer": "auto"}, {}, [])
    assert after[0] != before[0] and after[1] == before[1]
    assert fit_key({"model": "tanh+hardening-spring", "optimizer": "auto"}, {}, []) != after[1]


def test_an_effect_of_a_plugin_is_among_the_candidates_of_a_discovery(write: Write) -> None:
    before = {s.name for s in effects_for("force")}
    plugins.use(write((EXAMPLE / "mrfit_example" / "hardening_spring.py").read_text()))
    assert {s.name for s in effects_for("force")} - before == {"hardening-spring"}
    assert "hardening-spring" not in {s.name for s in effects_for("flux")}


def test_bounds_of_a_decorated_function_are_part_of_its_keys() -> None:
    found = []
    for high in (2.0, 2.0, 3.0):
        params = (PARAMS[0], Param("n", "1", 0.5, high, 1.0, text="power"))
        plugins.model("power-law", ["velocity"], "force", params)(power_law)
        found.append(plugins_used([("model", "power-law"), ("model", "tanh")]))
    assert found[0] == found[1] != found[2] and len(found[0]) == 1


def test_worker_processes_have_the_plugins(write: Write) -> None:
    plugins.use(write(factor=3))

    def peak(scale: float, told: object) -> float:
        out = registry.load("model", "dashpot").response(DRIVE, np.array([[scale]]), 1e-3)
        return float(out.max())

    assert list(in_processes(peak, [1.0, 10.0], 2, silent)) == pytest.approx([1.2, 12.0])


def test_processes_started_from_here_have_the_plugins(write: Write) -> None:
    plugins.use(write(factor=3))
    code = "from mrfit.core import registry; print(registry.load('model', 'dashpot').SPEC.title)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "A dashpot\n"


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The example package, installed."""
    folder = tmp_path / "site"
    folder.mkdir()
    install(folder)
    monkeypatch.syspath_prepend(str(folder))
    plugins.installed.cache_clear()
    yield folder
    plugins.installed.cache_clear()
    for name in [n for n in sys.modules if n.startswith("mrfit_example")]:
        del sys.modules[name]


def test_an_installed_package_adds_one_of_each_kind_and_none_is_imported_to_be_listed(site: Path) -> None:
    for kind, name in (
        ("model", "cubic-damper"),
        ("effect", "hardening-spring"),
        ("optimizer", "hooke"),
        ("reader", "acme"),
    ):
        assert name in registry.names(kind)
    assert not [n for n in sys.modules if n.startswith("mrfit_example")]
    assert registry.load("optimizer", "hooke").SPEC.kind == "local"
    assert registry.where("reader", "acme") == "mrfit_example.acme of the package mrfit-example 1.0"


def test_any_source_of_a_package_is_part_of_the_keys_of_its_items(site: Path) -> None:
    first = registry.digest("model", "cubic-damper")
    assert registry.digest("model", "cubic-damper") == first
    other = site / "mrfit_example" / "hooke.py"
    other.write_text(other.read_text() + "# more\n")
    assert registry.digest("model", "cubic-damper") != first


def test_a_package_and_a_file_with_one_name_clash(site: Path) -> None:
    with pytest.raises(
        ConfigError, match=r"mrfit_example.cubic_damper of the package mrfit-example 1.0 and .*/cubic-damper.py"
    ):
        plugins.use(_named(site.parent, "cubic-damper"))


def test_a_package_that_fails_or_is_called_otherwise_says_which_it_is(site: Path) -> None:
    module = site / "mrfit_example" / "cubic_damper.py"
    module.write_text(module.read_text().replace('name="cubic-damper"', 'name="cubic"'))
    with pytest.raises(ConfigError, match="the entry point calls it 'cubic-damper', its SPEC 'cubic'; let both"):
        registry.load("model", "cubic-damper")
    (site / "mrfit_example" / "hooke.py").write_text("1 / 0\n")
    told = (
        "mrfit_example.hooke of the package mrfit-example 1.0: ZeroDivisionError: division by zero; mend or uninstall"
    )
    with pytest.raises(ConfigError, match=told):
        registry.load("optimizer", "hooke")


def test_an_object_with_a_spec_can_be_registered() -> None:
    class Dashpot:
        SPEC = ModelSpec("dashpot", "A dashpot", "F = c*v", "", ("velocity",), "force", PARAMS[:1])

        @staticmethod
        def response(drive: Array, theta: Array, dt: float) -> Array:
            return theta[:, :1] * drive[0]

    plugins.register(Dashpot, "the test")
    assert assemble("dashpot").simulate(DRIVE, THETA[:, :1], 1e-3)[1, 0] == pytest.approx(-15.0)
    with pytest.raises(ConfigError, match="the other: its SPEC is no effect's"):
        plugins.check(Dashpot, "effect", "the other")


def test_help_looks_for_no_plugin_and_loads_no_numpy() -> None:
    code = """
        import sys
        import importlib.metadata
        importlib.metadata.entry_points = None
        from mrfit.cli.main import app
        app(["fit", "--help"], standalone_mode=False)
        sys.exit("numpy" in sys.modules or "mrfit.core.plugins" in sys.modules)
    """
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True)
    assert done.returncode == 0 and "--plugin" in done.stdout


SCALING = """
from mrfit.core.specs import EffectSpec, Param

SPEC = EffectSpec(
    name="my-fade", title="Fade", equation="fy*(1 - a)", reference="none", slot="theta", outputs=("force",), inputs=(),
    params=(Param("a", "1", 0.0, 1.0, 0.0, text="share"),), neutral=(0.0,), aliases=(), experiment="none",
)


def factors(channels, theta, dt):
    return {"yield": 1.0 - theta}


def law(a):
    return (1.0 - a,)
"""


def test_a_law_of_factors_without_roles_is_one_line(tmp_path: Path) -> None:
    place = tmp_path / "my_fade.py"
    place.write_text(SCALING)
    with pytest.raises(ConfigError, match="'my-fade' returns factors, and no ROLES says of which parameters"):
        plugins.use(place)
    place.write_text(SCALING + 'ROLES = ("yield",)\n')
    plugins.use(place)


def test_late_signals_without_a_longest_time_are_one_line(tmp_path: Path) -> None:
    place = tmp_path / "my_fade.py"
    place.write_text(SCALING + 'ROLES = ("yield",)\nLATE = 1\n')
    with pytest.raises(ConfigError, match="'my-fade' has LATE signals and no function longest"):
        plugins.use(place)
