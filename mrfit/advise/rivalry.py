"""The tests that separate what a discovery left standing, one to learn from and one to hold out."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrfit.advise.choose import Chosen, Judged, choose
from mrfit.advise.drives import Bench as Rigged
from mrfit.advise.drives import Test
from mrfit.advise.rig import Rig
from mrfit.advise.rivals import NOTHING, Rival, rivals_of, spec_of
from mrfit.advise.separation import Contest
from mrfit.advise.specimen import Specimen, rigged_of, unmovable
from mrfit.advise.standing import DRAWS, Model, fitted
from mrfit.core.progress import Progress, silent
from mrfit.core.specs import Array
from mrfit.discover.bench import Bench
from mrfit.errors import ConfigError, DataError
from mrfit.io.schemas.discovery import DiscoveryFile
from mrfit.simulate.assembly import assemble
from mrfit.simulate.current_dependence import CurrentDependence

# Standard errors below which no test tells a pair apart
APART = 3.0
# A second test to be held out differs by this factor in frequency, or by this share of the range in current
OTHER_FREQUENCY, OTHER_CURRENT = 1.4, 0.2


@dataclass(frozen=True)
class Advice:
    """What came of a search for the next test that separates rivals.

    Attributes
    ----------
    rivals
        Names of the models.
    pairs
        Every two of them.
    before
        Standard errors by which the data there are put them apart (pairs,).
    open
        Which pairs some test of the rig puts apart (pairs,).
    chosen
        The tests.
    companion
        A second test of the kind of the first one, to be held out; None if there is none.
    contest
        The models.
    """

    rivals: tuple[Rival, ...]
    pairs: tuple[tuple[int, int], ...]
    before: Array
    open: Array
    chosen: Chosen
    companion: Judged | None
    contest: Contest


def separate(bench: Bench, found: DiscoveryFile, rig: Rig, seed: int, progress: Progress = silent) -> Advice:
    """Return the tests that separate the rivals that a discovery left standing."""
    stored = found.current_dependence
    dependence = stored and CurrentDependence(tuple(tuple(o) for o in stored.orders), stored.low, stored.high)
    start = {str(n): float(v) for n, v in found.settings.get("start", [])}
    base = assemble(found.base_model, dependence)
    specimen = Specimen.of(bench, base, rig)
    rigged = rigged_of(bench, specimen.channels, rig)
    rivals = _movable(rivals_of(found), specimen, rig)
    standings = fitted(bench, Model(found.base_model, dependence, start, seed), rivals, progress)
    draws = [s.draws(DRAWS, np.random.default_rng([seed, k])) for k, s in enumerate(standings)]
    noise = float(np.sqrt(np.mean([s.floor**2 for s in bench.of_role("train")])))
    contest = Contest.of(standings, draws, noise, specimen)

    def judge(contest: Contest, test: Test) -> Judged | None:
        shown = contest.shown(test)
        if not shown.finite or (rig.force is not None and shown.peak > rig.force and specimen.channels.rate):
            return None
        return Judged(test, contest.distances(shown))

    chosen = choose(rigged, lambda t: judge(contest, t), seed, progress, lambda most: most >= APART, rigged.kinds)
    if not chosen.tests:
        raise ConfigError(f"every test within [rig] takes more than its force, {rig.force:g}; give wider limits")
    separable = chosen.most >= APART
    companion = None
    if separable.any():
        first = chosen.tests[0].test

        def other(test: Test) -> Judged | None:
            return judge(contest, test) if _differs(test, first, rigged) else None

        companion = next(
            iter(choose(rigged, other, seed + 1, silent, lambda most: separable, (first.kind,)).tests), None
        )
    return Advice(tuple(rivals), tuple(contest.pairs), contest.left(), separable, chosen, companion, contest)


def _differs(test: Test, first: Test, rigged: Rigged) -> bool:
    ratio = test.numbers["frequency"] / first.numbers["frequency"]
    span = 0.0 if rigged.current is None else rigged.current[1] - rigged.current[0]
    moved = abs(test.numbers.get("current", 0.0) - first.numbers.get("current", 0.0))
    return max(ratio, 1.0 / ratio) >= OTHER_FREQUENCY or moved > OTHER_CURRENT * span > 0.0


def _movable(rivals: Sequence[Rival], specimen: Specimen, rig: Rig) -> list[Rival]:
    """Return the rivals that the rig can show; of those that a discovery states it has to be all."""
    kept = []
    for rival in rivals:
        lacking = "" if rival.name == NOTHING else unmovable(spec_of(rival.name).inputs, specimen, rig)
        if not lacking:
            kept.append(rival)
        elif not rival.hidden:
            raise ConfigError(f"{rival.name} needs {lacking} to move, which [rig] does not state: add {lacking} to it")
    if len(kept) < 2:
        raise DataError("no rival is left that the rig can show: [rig] moves none of what they need")
    return kept
