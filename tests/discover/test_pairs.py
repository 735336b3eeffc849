"""Two effects of which neither is of use alone are found together, and none where nothing is missing."""

from pathlib import Path

from mrfit import registry
from mrfit.assembly import assemble
from mrfit.discover.bench import build_bench
from mrfit.discover.pairs import best_pair
from mrfit.discover.refit import Fitter, Refit
from mrfit.discover.screen import screen
from mrfit.discover.trials import try_out
from mrfit.fit.stage import load_recordings
from mrfit.progress import silent
from tests.discover.studies import workspace

LIBRARY = ("inertia", "quadratic-drag", "coulomb-friction")


def found_in(folder: Path, mass: float, drag: float) -> Refit | None:
    """Return the best pair among three effects, of which only friction was tried alone."""
    study = workspace(folder, mass=mass, drag=drag)
    segments, _ = study.read_segments()
    effects = [registry.load("effect", name).SPEC for name in LIBRARY]
    bench = build_bench(segments, load_recordings(study, segments), assemble("tanh"), effects)
    fitter = Fitter(bench, "tanh", None, {}, {}, lambda effects, point: None)
    base = fitter.first(0)
    screened = screen(fitter, base, effects)
    trials = [try_out(fitter, base, s, base) for s in screened if s.name == "coulomb-friction"]
    return best_pair(fitter, base, base, (screened, trials), silent)


def test_a_pair_is_found_though_neither_was_tried_alone(tmp_path: Path) -> None:
    found = found_in(tmp_path, mass=12.0, drag=2500.0)
    assert found is not None and found.effects == ("inertia", "quadratic-drag")
    assert found.chi("holdout") < 1.1


def test_no_pair_is_looked_for_where_only_noise_is_left(tmp_path: Path) -> None:
    assert found_in(tmp_path, mass=0.0, drag=0.0) is None
