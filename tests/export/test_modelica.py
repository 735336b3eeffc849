"""The Modelica package: the C behind its block is the model; its text is Modelica, where a parser is installed."""

import re
from pathlib import Path

import numpy as np
import pytest

from mrfit.core import registry
from mrfit.export.compiler import compiler
from mrfit.export.modelica import files
from mrfit.export.units import modelica_unit
from mrfit.settings.export import Settings
from mrfit.simulate.current_dependence import CurrentDependence, orders_of
from tests.export.rigs import rig


@pytest.mark.skipif(compiler() is None, reason="no C compiler")
@pytest.mark.parametrize("model", ["tanh", "boucwen+asymmetry", "tanh+delay"])
def test_the_block_s_c_is_the_simulation(model: str) -> None:
    made = files(rig(model), Settings())
    assert made.error is not None and made.error < 1e-9
    assert "no Modelica tool has called yet" in made.said[0]
    prefix = next(iter(made.contents)).split("/")[1]
    assert set(made.contents) == {
        f"modelica/{prefix}/package.mo",
        *(f"modelica/{prefix}/Resources/Include/{prefix}{end}" for end in (".h", ".c", "_modelica.h")),
    }


def test_parameters_have_names_of_their_own_and_the_fit_s_values() -> None:
    spec = registry.load("model", "tanh").SPEC
    # either side of a jump a value's name differs in a sign only
    source = rig("tanh", CurrentDependence(orders_of(spec, "fy=1/0.7/1"), 0.2, 1.4))
    (text,) = (t.decode() for n, t in files(source, Settings()).contents.items() if n.endswith(".mo"))
    for name, value in zip(("fy_0_2A", "fy_0_7A_", "fy_0_7A__2", "fy_1_4A"), source.theta[:4], strict=True):
        assert f'parameter Real {name}(unit = "N") = {float(value)!r} ' in text
    assert np.isfinite(source.theta).all()


@pytest.mark.parametrize(
    ("unit", "written"),
    [
        ("1", "1"),
        ("N*s/m", "N.s/m"),
        ("N*s^2/m^2", "N.s2/m2"),
        ("1/A^2", "1/A2"),
        ("m/s/A", "m/(s.A)"),
        ("ohm/A^2/s", "Ohm/(A2.s)"),
        ("N*m*s/rad", "N.m.s/rad"),
    ],
)
def test_units_are_written_as_modelica_writes_them(unit: str, written: str) -> None:
    assert modelica_unit(unit) == written


def text_of(model: str) -> tuple[str, str]:
    """Return the package's name and text."""
    made = files(rig(model), Settings())
    (text,) = (t.decode() for n, t in made.contents.items() if n.endswith(".mo"))
    return next(iter(made.contents)).split("/")[1], text


@pytest.mark.parametrize("model", ["tanh", "boucwen-flux+eddy-current", "rotational-erf+temperature"])
def test_a_compiler_finds_no_fault_in_its_names_types_and_units(model: str, tmp_path: Path) -> None:
    rumoca = pytest.importorskip("rumoca", reason="not run: pip install rumoca")
    name, text = text_of(model)
    (tmp_path / "package.mo").write_text(text)
    # it goes no further than this, since it knows no external objects
    with pytest.raises(rumoca.CompileError, match="^todae failed: .*has unsupported type `State`"):
        rumoca.Session().load(str(tmp_path / "package.mo"), model=f"{name}.Model")
    broken = text.replace("period,\n", "perio,\n")
    (tmp_path / "package.mo").write_text(broken)
    with pytest.raises(rumoca.CompileError, match="perio"):
        rumoca.Session().load(str(tmp_path / "package.mo"), model=f"{name}.Model")


def test_a_compiler_steps_the_block_at_its_period(tmp_path: Path) -> None:
    """The block as it stands, with a step in Modelica where the package has one in C."""
    rumoca = pytest.importorskip("rumoca", reason="not run: pip install rumoca")
    name, text = text_of("tanh")
    text = text[: text.index("  class State")] + text[text.index("  impure function step") :]
    for old, new in (("impure ", ""), ("    input State state;\n", ""), ("        state,\n", "")):
        assert old in text
        text = text.replace(old, new)
    text = text.replace("    State state = State();\n", "")
    body = "  algorithm\n    force := theta[2]*displacement + velocity;\n    in_range := 1;\n  end step;"
    text = re.sub(r"  external \"C\".*?  end step;", body, text, flags=re.DOTALL)
    drive = "displacement = 0.004*sin(20*time), velocity = 0.08*cos(20*time)"
    test = f"{text}\nmodel Test\n  {name}.Model m({drive});\nend Test;"
    (tmp_path / "test.mo").write_text(test)
    source = rig("tanh")
    period = source.stretches[0].dt
    found = rumoca.Session().load(str(tmp_path / "test.mo"), model="Test").simulate(t=(0.0, 0.05), dt=period / 4)
    time, force = np.array(found["time"]), np.array(found["m.force"])
    # what it gave at the end of each instant, held until the next
    at = np.array([np.flatnonzero(np.isclose(time, t))[-1] for t in np.unique(time)])
    held = np.floor(time[at] / period + 1e-6) * period
    wanted = source.theta[1] * 0.004 * np.sin(20 * held) + 0.08 * np.cos(20 * held)
    np.testing.assert_allclose(force[at], wanted, rtol=1e-9)


def test_a_parser_reads_it() -> None:
    parser = pytest.importorskip("pymoca.parser", reason="not run: pip install pymoca")
    for model in ("tanh", "boucwen-flux+eddy-current"):
        made = files(rig(model), Settings())
        (text,) = (t.decode() for n, t in made.contents.items() if n.endswith(".mo"))
        tree = parser.parse(text)
        package = next(c for n, c in tree.classes.items() if n == next(iter(made.contents)).split("/")[1])
        assert list(package.classes) == ["State", "step", "Model"]
