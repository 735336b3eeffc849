"""The compile policy: bits, IEEE division, and a cache that sees every edit of a kernel source."""

import os
from pathlib import Path

import numpy as np
import pytest

from mrfit.kernels.jit import bits, from_bits, is_cold, kernel


@kernel
def halve_exponent_bits(x: float) -> float:
    return from_bits(bits(x) - (1 << 52))


@kernel
def reciprocal(x: float) -> float:
    return 1.0 / x


def test_bits_of_a_float_are_its_ieee_754_bits() -> None:
    assert halve_exponent_bits(3.0) == 1.5
    assert halve_exponent_bits(np.pi) == np.pi / 2


def test_division_by_zero_gives_infinity_instead_of_raising() -> None:
    assert reciprocal(0.0) == np.inf


def test_cache_folder_is_named_after_the_sources() -> None:
    folder = Path(os.environ["NUMBA_CACHE_DIR"])
    assert folder.name.rsplit("-", 1)[1].isalnum()


def test_a_folder_without_compiled_kernels_is_cold(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "none"))
    assert is_cold()
    monkeypatch.undo()
    halve_exponent_bits(1.0)
    assert not is_cold()
