"""An advice in words: as many pairs as a sentence takes are named."""

from pathlib import Path

import pytest

from mrfit.advise.rivals import NO_MORE_RIVALS
from mrfit.advise.stage import AdviceFiles, write
from mrfit.advise.words import MOST_PAIRS, of_rivals
from mrfit.io.replaced import replaced_files
from mrfit.io.schemas.advice import AdviceFile, AdvisedTest, Pair


@pytest.mark.parametrize(("never", "more"), [(0, ""), (MOST_PAIRS, ""), (MOST_PAIRS + 3, "3 more pairs")])
def test_pairs_that_no_test_tells_apart_are_named_up_to_a_few(never: int, more: str) -> None:
    pairs = [Pair(names=("a", "b"), before=0.5, separable=True)]
    pairs += [Pair(names=(f"c{k}", f"d{k}"), before=0.1, separable=False) for k in range(never)]
    own = {"kind": "sine", "numbers": {}, "distances": (4.0,) * len(pairs)}
    test = AdvisedTest(text="a sine", seconds=10.0, waiting=0.0, worth=1.0, drive="test-1.csv", **own)
    said = " ".join(of_rivals(pairs, [test], None))
    assert "it puts a and b at least 4 standard errors apart" in said
    assert sum(f"c{k} from d{k}" in said for k in range(never)) == min(never, MOST_PAIRS)
    assert ("more pairs, which advise.json names" in said) == bool(more) and more in said
    assert ("No test within these limits" in said) == bool(never)


def test_effects_that_no_test_would_show_are_said_as_such() -> None:
    names = (("a", "b"), (NO_MORE_RIVALS, "c"), (NO_MORE_RIVALS, "d"), ("e", "f"))
    pairs = [Pair(names=n, before=0.5, separable=n == ("a", "b")) for n in names]
    own = {"kind": "sine", "numbers": {}, "distances": (4.0,) * len(pairs)}
    test = AdvisedTest(text="a sine", seconds=10.0, waiting=0.0, worth=1.0, drive="test-1.csv", **own)
    said = of_rivals(pairs, [test], None)
    assert said[1:] == ["No test within these limits would show c or d.", "No test within these limits tells e from f."]
    put = of_rivals([Pair(names=(NO_MORE_RIVALS, "c"), before=0.5, separable=True)], [test], None)[0]
    assert "it puts the model as found and c at least 4 standard errors apart (the model as found and c)" in put


@pytest.mark.parametrize(("distance", "least", "left"), [(2.0, "4", True), (3.5, "3.5", False)])
def test_a_pair_that_another_test_separates_is_left_to_it(distance: float, least: str, left: bool) -> None:
    pairs = [Pair(names=n, before=0.5, separable=True) for n in (("a", "b"), ("c", "d"))]
    own = {"kind": "sine", "numbers": {}, "distances": (4.0, distance)}
    test = AdvisedTest(text="a sine", seconds=10.0, waiting=0.0, worth=1.0, drive="test-1.csv", **own)
    said = " ".join(of_rivals(pairs, [test], None))
    assert f"at least {least} standard errors apart" in said and ("puts a, b, c" in said) != left
    assert ("It leaves 1 more pair closer that another test separates" in said) == left


def test_drives_of_another_advice_are_noted_as_replaced_and_the_same_ones_are_not(tmp_path: Path) -> None:
    content = AdviceFile(
        goal="parameters", model="tanh", text=(), tests=(), rig={}, looked_at=1, refused=0, noise=1.0, seed=0, code=""
    )
    first, drive = AdviceFiles(content, {"test-1.csv": "a", "companion.csv": "b"}), tmp_path / "test-1.csv"
    for made, replaced in ((first, []), (first, []), (AdviceFiles(content, {"test-1.csv": "c"}), [drive])):
        with replaced_files() as found:
            write(tmp_path, made)
        assert found == replaced
    assert {p.name for p in tmp_path.iterdir()} == {"advise.json", "test-1.csv"}
