"""Options of the form NAME=VALUE say how they are written."""

import pytest

from mrfit.errors import ConfigError
from mrfit.options import limits


def test_bounds_are_two_numbers() -> None:
    assert limits(["A=1:2.5", "fy@0A=0:3"]) == (("A", 1.0, 2.5), ("fy@0A", 0.0, 3.0))


def test_bounds_without_a_colon_are_shown_their_form() -> None:
    with pytest.raises(ConfigError, match="takes NAME=LOW:HIGH, not 'A=2'"):
        limits(["A=2"])
