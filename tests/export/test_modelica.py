"""The Modelica package: the C behind its block is the model; its text is Modelica, where a parser is installed."""

import numpy as np
import pytest

from mrfit.core import registry
from mrfit.export.compiler import compiler
from mrfit.export.modelica import files
from mrfit.settings.export import Settings
from mrfit.simulate.current_dependence import CurrentDependence, orders_of
from tests.export.rigs import rig


@pytest.mark.skipif(compiler() is None, reason="no C compiler")
@pytest.mark.parametrize("model", ["tanh", "boucwen+asymmetry"])
def test_the_block_s_c_is_the_simulation(model: str) -> None:
    made = files(rig(model), Settings())
    assert made.error is not None and made.error < 1e-9
    assert "no Modelica compiler has run" in made.said[0]
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


def test_a_parser_reads_it() -> None:
    parser = pytest.importorskip("pymoca.parser", reason="not run: pip install pymoca")
    for model in ("tanh", "boucwen-flux+eddy-current"):
        made = files(rig(model), Settings())
        (text,) = (t.decode() for n, t in made.contents.items() if n.endswith(".mo"))
        tree = parser.parse(text)
        package = next(c for n, c in tree.classes.items() if n == next(iter(made.contents)).split("/")[1])
        assert list(package.classes) == ["State", "step", "Model"]
