"""The page of public benchmarks is that of its result files, and a sequence is scored behind its known beginning."""

import json

import numpy as np
import pytest

from benchmarks import magnet, public_benchmarks
from tests.conftest import ROOT


def test_the_page_is_that_of_the_result_files() -> None:
    page = ROOT / "docs" / "public_benchmarks.md"
    assert page.read_text(encoding="utf-8") == public_benchmarks.page() + "\n"


def test_the_scores_are_those_of_the_sequences() -> None:
    found = json.loads((public_benchmarks.RESULTS / "magnet.json").read_text(encoding="utf-8"))
    assert len(found["errors"]) == len(found["lstm"]) == 105 and len(found["fits"]) == magnet.GROUPS
    # as the organisers give it
    assert np.mean(found["lstm"]) == pytest.approx(0.1383, abs=1e-4)
    assert np.percentile(found["lstm"], 95) == pytest.approx(0.2831, abs=1e-4)
    assert found["parameters"] <= 20


def test_a_sequence_is_early_by_samples_and_scored_behind_its_beginning() -> None:
    b, h = np.linspace(0.0, 1.0, 11) ** 2, np.linspace(1.0, 2.0, 11)
    one = magnet.Transient(b, h, 25.0, 4)
    assert one.error(h) == 0.0 and one.error(2.0 * h) == pytest.approx(1.0)
    assert one.error(np.where(np.arange(11) < 4, 0.0, h)) == 0.0
    np.testing.assert_allclose(one.early(2), [*b[2:], 1.0 + 0.19, 1.0 + 0.38])
