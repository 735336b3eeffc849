"""The pattern proposed for names reads every one of them."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrfit.ingest.meaning.conditions import from_name
from mrfit.ingest.suggestion import pattern_of


@pytest.mark.parametrize(
    ("stems", "pattern"),
    [
        (["2mm5Hz0x25A", "25mm0x5Hz0A"], "{amplitude:mm}mm{frequency:Hz}Hz{current:A}A"),
        (["sine_1Hz_3A", "square_5Hz_2A"], "{frequency:Hz}Hz_{current:A}A"),
        (["run 3 10mm fast 2Hz", "run 4 5mm slow 1Hz"], "{amplitude:mm}mm*{frequency:Hz}Hz"),
        (["ME2mm5Hz", "ME5mm4Hz"], "{amplitude:mm}mm{frequency:Hz}Hz"),
        (["damper 20degC 2A"], "{temperature:degC}degC {current:A}A"),
        (["SPC1", "SPC2"], ""),
        (["2mm5Hz", "readme"], ""),
        (["2mm5Hz", "2mm5A"], ""),
        ([], ""),
        (["log_2024"], ""),
    ],
)
def test_the_pattern_that_names_follow(stems: list[str], pattern: str) -> None:
    assert pattern_of(stems) == pattern


@given(
    st.lists(
        st.tuples(st.integers(1, 99), st.sampled_from([0.25, 0.5, 1, 2]), st.integers(0, 9)), min_size=1, max_size=5
    ),
    st.just("") | st.text("abd {}*_(", max_size=6).map("_{}_".format),
)
def test_a_proposed_pattern_reads_what_the_names_state(tests: list[tuple[int, float, int]], between: str) -> None:
    stems = [f"x{a}mm{between}{f:g}Hz-{i}A".replace("0.", "0x") for a, f, i in tests]
    pattern = pattern_of(stems)
    for stem, (a, f, i) in zip(stems, tests, strict=True):
        assert from_name(stem, pattern) == pytest.approx({"amplitude": a * 1e-3, "frequency": f, "current": float(i)})
