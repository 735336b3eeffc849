"""What is printed compiles without a warning and gives what Python gives, in C and in MATLAB; the rest is refused."""

import inspect
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.export.compiler import compiler
from mrfit.export.printer.c_text import constants, function_text, macros, math_functions, small_functions
from mrfit.export.printer.functions import python_of
from mrfit.export.printer.ir import REAL, Function, Program
from mrfit.export.printer.matlab_text import matlab_text
from mrfit.export.printer.reading import ProgramReader
from mrfit.kernels import filters
from tests.export.printer import subset
from tests.export.test_c import STRICT

OCTAVE = shutil.which("octave-cli") or shutil.which("octave") or ""
ROWS = 300
# Kernels of the package beside the cases made for it
KERNELS = (filters.gained_from_bend, filters.release)


def read(*given: Any) -> tuple[Program, list[Function]]:
    reader, found = ProgramReader(("main",)), []
    for one in given:
        function = python_of(one)
        assert function is not None
        kinds = dict.fromkeys(inspect.signature(function).parameters, REAL)
        found.append(reader.function(function, kinds).function)
    return reader.settled(), found


def drawn(count: int, seed: int) -> Array:
    """Return rows of arguments, with zeros, equal ones and ones of either sign among them."""
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=(ROWS, count)) * rng.choice([0.1, 1.0, 4.0], (ROWS, 1))
    rows[:4], rows[4] = rng.choice([0.0, -0.0, 0.5, -1.0], (4, count)), 1.5
    return rows


def wanted(function: Callable[..., Any], rows: Array) -> Array:
    plain = python_of(function)
    assert plain is not None

    def flat(value: Any) -> list[float]:
        return [v for one in value for v in flat(one)] if isinstance(value, tuple) else [float(value)]

    return np.array([flat(plain(*row)) for row in rows.tolist()])


def c_program(program: Program, called: list[Function], real: str) -> str:
    """Return a program that reads the place of a function and its arguments, and writes what that gives."""
    text = "\n\n".join([small_functions(program), constants(program), *map(function_text, program.functions.values())])
    cases = []
    for k, f in enumerate(called):
        values = [f"(@real)row[{j + 1}]" for j in range(len(f.arguments))]
        outputs = [f"&out[{j}]" for j in range(len(f.outputs))]
        call = f"{f.name}({', '.join(values + outputs)})"
        cases.append(f"case {k}: {call if f.outputs else f'out[0] = {call}'}; break;")
    main = f"""int main(void)
{{
    double row[8];
    while (fread(row, sizeof(double), 8U, stdin) == 8U) {{
        @real out[4] = {{ 0 }};
        double wide[4];
        switch ((int)row[0]) {{ {" ".join(cases)} default: return 1; }}
        for (int k = 0; k < 4; k++) {{ wide[k] = (double)out[k]; }}
        (void)fwrite(wide, sizeof(double), 4U, stdout);
    }}
    return 0;
}}"""
    end = "f" if real == "float" else ""
    lines = [f"#define {n.upper()}_{given} {n}{end}{values}" for n, given, values in macros(math_functions(program))]
    head = ["#include <math.h>", "#include <stdio.h>", f"#define K(x) (({real})(x))", *lines]
    return "\n".join([*head, text, "", main, ""]).replace("@real", real)


def run_c(program: Program, called: list[Function], rows: list[Array], folder: Path, real: str) -> list[Array]:
    (folder / "made.c").write_text(c_program(program, called, real))
    command = [str(compiler()), "-std=c99", *STRICT, "made.c", "-lm", "-o", "made"]
    subprocess.run(command, cwd=folder, check=True)
    padded = [np.column_stack([np.full(ROWS, k), r, np.zeros((ROWS, 7 - r.shape[1]))]) for k, r in enumerate(rows)]
    given = np.vstack(padded).astype(np.float64).tobytes()
    done = subprocess.run([folder / "made"], input=given, capture_output=True, check=True)
    return list(np.frombuffer(done.stdout).reshape(len(called), ROWS, 4))


@pytest.mark.skipif(compiler() is None, reason="no C compiler")
@pytest.mark.parametrize(("real", "tolerance"), [("double", 1e-12), ("float", 2e-4)])
def test_the_c_is_the_function(tmp_path: Path, real: str, tolerance: float) -> None:
    cases = (*subset.CASES, *KERNELS)
    program, called = read(*cases)
    rows = [drawn(len(f.arguments), seed).astype(np.dtype(real)).astype(float) for seed, f in enumerate(called)]
    for case, given, got in zip(cases, rows, run_c(program, called, rows, tmp_path, real), strict=True):
        expected = wanted(case, given)
        off = np.abs(got[:, : expected.shape[1]] - expected) / (1.0 + np.abs(expected))
        # rounded arguments may lie on the other side of a comparison
        assert np.quantile(off, 0.98 if real == "float" else 1.0) < tolerance, case


@pytest.mark.skipif(not OCTAVE, reason="no Octave")
def test_the_matlab_is_the_function(tmp_path: Path) -> None:
    program, called = read(*subset.CASES)
    rows = [drawn(len(f.arguments), seed) for seed, f in enumerate(called)]
    lines = []
    for f, given in zip(called, rows, strict=True):
        np.savetxt(tmp_path / f"{f.name}.txt", given, fmt="%.17g")
        outputs = ", ".join(f"out({j + 1})" for j in range(max(len(f.outputs), 1)))
        arguments = ", ".join(f"rows(k, {j + 1})" for j in range(len(f.arguments)))
        lines += [
            f"rows = dlmread('{f.name}.txt'); file = fopen('{f.name}.out', 'w');",
            f"for k = 1:size(rows, 1); out = zeros(1, 4); [{outputs}] = {f.name}({arguments});",
            "fprintf(file, '%.17g %.17g %.17g %.17g\\n', out); end; fclose(file);",
        ]
    sign = (
        "function y = copy_sign(x, s)\nif s < 0 || (s == 0 && 1 / s < 0)\ny = -abs(x);\nelse\ny = abs(x);\nend\nend\n"
    )
    (tmp_path / "all_of_it.m").write_text("\n".join(["1;", matlab_text(program), sign, *lines]))
    subprocess.run([OCTAVE, "--no-gui", "--norc", "--quiet", "all_of_it.m"], cwd=tmp_path, check=True)
    for case, f, given in zip(subset.CASES, called, rows, strict=True):
        expected = wanted(case, given)
        got = np.loadtxt(tmp_path / f"{f.name}.out")[:, : expected.shape[1]]
        np.testing.assert_allclose(got, expected, rtol=1e-12, atol=1e-12, err_msg=str(case))


@pytest.mark.parametrize("function", subset.OUTSIDE)
def test_what_is_outside_the_subset_is_one_line_with_its_place(function: Any) -> None:
    with pytest.raises(DataError) as raised:
        read(function)
    text, told = str(raised.value), subset.OUTSIDE[function]
    assert "\n" not in text and any(t in text for t in told.split("|"))
    found = re.match(r"subset.py:(\d+): ", text)
    lines, first = inspect.getsourcelines(function)
    assert found and first < int(found[1]) < first + len(lines)


def test_names_comments_and_equations_stay() -> None:
    program, (function,) = read(subset.chain)
    text = function_text(function)
    assert text.startswith("/* One of four, by comparisons in a row */\nstatic @real chain(@real x, @real y)\n{\n")
    assert "        /* what is left */\n        value = -x;" in text
    # a constant of one function stands in it, as MISRA wants it
    assert "    /* How fast it fades */\n    const @real FADING = K(0.3);" in text and not constants(program)
    assert "% what is left" in matlab_text(program)


def test_a_function_has_one_exit_and_constants_are_declared_as_such() -> None:
    program, _ = read(subset.early, subset.from_loop, subset.both)
    texts = [function_text(f) for f in program.functions.values()]
    assert all(t.count("return ") <= 1 for t in texts)
    assert "const @real low" not in "".join(texts)  # a call fills it in
    assert "@real x = x_start;" in texts[0]
