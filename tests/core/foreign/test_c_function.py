"""A C function is given rows as its signature says; what it says has failed, or leaves out, is no number."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrfit.core.foreign.c_function import c_function_model
from mrfit.core.foreign.model import constant_only
from mrfit.core.specs import Array, ModelSpec, Param
from mrfit.errors import ConfigError
from tests.core.foreign.compiled import compiled

# The last channel but for the last sample, which is not filled in; the last parameter is the answer
TEXT = """
#include <stdint.h>
int last(const double *drive, const double *theta, double *output,
         int64_t channels, int64_t samples, int64_t parameters, double dt)
{
    for (int64_t n = 0; n < samples - 1; n++) output[n] = dt * drive[(channels - 1) * samples + n] + theta[0];
    return (int)theta[parameters - 1];
}
int other(void) { return 1; }
"""
SPEC = ModelSpec(
    name="last",
    title="The last channel",
    equation="",
    reference="",
    inputs=("velocity", "current"),
    output="force",
    params=(Param("a", "N", 0.0, 1e4, 1.0), Param("answer", "1", 0.0, 9.0, 0.0)),
)


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compiled(TEXT, tmp_path_factory.mktemp("c") / "last.so")


def test_rows_are_given_in_their_order_whatever_they_are_in_memory(library: Path) -> None:
    response = c_function_model(SPEC, library, "last").item.response
    drive, theta = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]), np.array([[10.0, 0.0], [20.0, 0.0]])
    wanted = [[12.0, 12.5, np.nan], [22.0, 22.5, np.nan]]
    np.testing.assert_array_equal(response(drive, theta, 0.5), wanted)
    for other in (np.asfortranarray(drive), np.repeat(drive, 2, axis=1)[:, ::2], drive.astype(np.int64)):
        np.testing.assert_array_equal(response(other, np.asfortranarray(theta), 0.5), wanted)


def test_an_answer_other_than_0_makes_all_samples_no_number(library: Path) -> None:
    response = c_function_model(SPEC, library, "last").item.response
    found = response(np.ones((2, 3)), np.array([[1.0, 2.0], [1.0, -1.0], [1.0, 0.0]]), 1.0)
    assert np.isnan(found[:2]).all() and found[2, 0] == 2.0


def test_spec_function_and_library_are_what_a_model_is_known_by(library: Path, tmp_path: Path) -> None:
    one = c_function_model(SPEC, library, "last")
    again = c_function_model(SPEC, compiled(TEXT + "int third;", tmp_path / "last.so"), "last")
    named = c_function_model(replace(SPEC, output="torque"), library, "last")
    sources = {one.source, again.source, named.source, c_function_model(SPEC, library, "other").source}
    assert len(sources) == 4 and c_function_model(SPEC, library, "last").source == one.source
    assert one.item.SPEC.caution.startswith("the model last is a C function") and one.item.CONSTANT_PARAMETERS
    assert one.item.__doc__ == "The last channel" and replace(one.item.SPEC, caution=SPEC.caution) == SPEC


def test_parameters_that_vary_along_the_samples_are_refused_and_others_passed_on() -> None:
    def response(drive: Array, theta: Array, dt: float) -> Array:
        return dt * theta

    checked = constant_only("last", response)
    np.testing.assert_array_equal(checked(np.ones((1, 2)), np.ones((1, 2)), 3.0), [[3.0, 3.0]])
    with pytest.raises(ConfigError, match="^the parameters of last cannot vary within a test.*--current-order 0$"):
        checked(np.ones((1, 2)), np.ones((1, 2, 2)), 3.0)
