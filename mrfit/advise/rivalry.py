"""The tests that separate what a discovery left standing, one to learn from and one to hold out."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrfit.advise.choose import Judge, ScoredTest, Task, TestChoice, choose
from mrfit.advise.drives import RigBench as Rigged
from mrfit.advise.drives import Test
from mrfit.advise.readings import ReadingSet
from mrfit.advise.rig import Rig
from mrfit.advise.rivals import NO_MORE_RIVALS, Rival, rivals_of, spec_of
from mrfit.advise.separation import RivalSet
from mrfit.advise.specimen import Specimen, rigged_of, unmovable
from mrfit.advise.standing import DRAWS, RivalModel, fitted
from mrfit.core.progress import Progress, silent
from mrfit.core.specs import Array, Mask
from mrfit.discover.evidence.bench import Bench
from mrfit.discover.invariance.records import from_block
from mrfit.errors import ConfigError, DataError
from mrfit.io.schemas.discovery import DiscoveryFile
from mrfit.simulate.assembly import assemble
from mrfit.simulate.current_dependence import CurrentDependence

# Standard errors below which no test tells a pair apart
ERRORS_APART = 3.0
# A second test to be held out differs by this factor in frequency, or by this share of the range in current
OTHER_FREQUENCY, OTHER_CURRENT = 1.4, 0.2


@dataclass(frozen=True)
class SeparationAdvice:
    """What came of a search for the next test that separates rivals.

    Attributes
    ----------
    rivals
        Names of the models, or the readings.
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
        The models, or the readings of a formula.
    """

    rivals: tuple[str, ...]
    pairs: tuple[tuple[str, str], ...]
    before: Array
    open: Mask
    chosen: TestChoice
    companion: ScoredTest | None
    contest: RivalSet | ReadingSet


def separate(bench: Bench, found: DiscoveryFile, rig: Rig, seed: int, progress: Progress = silent) -> SeparationAdvice:
    """Return the tests that separate the readings of a formula, or the rivals, that a discovery left standing.

    Raises
    ------
    ConfigError
        If the rig's limits leave no test, or a rival needs a channel that the rig does not move.
    DataError
        If there are no rivals.
    """
    model = _model(found, seed)
    specimen = Specimen.of(bench, assemble(model.base, model.dependence), rig)
    rigged = rigged_of(bench, specimen.channels, rig)
    contest: RivalSet | ReadingSet
    if found.proposed and len(found.proposed.readings) > 1:
        output = assemble(model.base).spec.output
        records = [from_block(s.block, s.names, output) for s in bench.of_role("train")]
        contest = ReadingSet.of(records, found.proposed, specimen)
    else:
        rivals = _movable(rivals_of(found), bench, specimen, rig)
        contest = _models(bench, model, rivals, specimen, progress)
    most = rig.force if rig.force is not None and specimen.channels.rate else np.inf

    def judge(test: Test) -> ScoredTest | None:
        distances = contest.apart(test, most)
        return None if distances is None else ScoredTest(test, distances)

    chosen = choose(Task(rigged, judge, lambda most: most >= ERRORS_APART, rigged.kinds), seed, progress)
    if not chosen.tests:
        limit = "diverges" if rig.force is None else f"diverges or takes more than its force, {rig.force:g}"
        raise ConfigError(f"every test within [rig] {limit}; give other limits")
    separable = chosen.most >= ERRORS_APART
    companion = _companion(rigged, judge, chosen.tests[0].test, separable, seed + 1)
    names = contest.names
    pairs = tuple((names[a], names[b]) for a, b in contest.pairs)
    return SeparationAdvice(names, pairs, contest.left(), separable, chosen, companion, contest)


def _models(
    bench: Bench, model: RivalModel, rivals: Sequence[Rival], specimen: Specimen, progress: Progress
) -> RivalSet:
    """Return rivals fitted to the data there are, with what they may be."""
    standings = fitted(bench, model, rivals, progress)
    draws = [s.draws(DRAWS, np.random.default_rng([model.seed, k])) for k, s in enumerate(standings)]
    noise = float(np.sqrt(np.mean([s.floor**2 for s in bench.of_role("train")])))
    return RivalSet.of(standings, draws, noise, specimen)


def _companion(rigged: Rigged, judge: Judge, first: Test, separable: Mask, seed: int) -> ScoredTest | None:
    """Return the best test of the kind of the first one that is no repetition of it, so that one can be held out."""
    if not separable.any():
        return None

    def other(test: Test) -> ScoredTest | None:
        return judge(test) if _differs(test, first, rigged) else None

    found = choose(Task(rigged, other, lambda most: separable, (first.kind,)), seed, silent)
    return found.tests[0] if found.tests else None


def _model(found: DiscoveryFile, seed: int) -> RivalModel:
    """Return what a discovery fitted."""
    stored = found.current_dependence
    orders = () if stored is None else tuple((name, order) for name, order in stored.orders)
    dependence = None if stored is None else CurrentDependence(orders, stored.low, stored.high)
    start = {str(name): float(value) for name, value in found.settings.get("start", [])}
    return RivalModel(found.base_model, dependence, start, seed)


def _differs(test: Test, first: Test, rigged: Rigged) -> bool:
    ratio = test.numbers["frequency"] / first.numbers["frequency"]
    span = 0.0 if rigged.current is None else rigged.current[1] - rigged.current[0]
    moved = abs(test.numbers.get("current", 0.0) - first.numbers.get("current", 0.0))
    return max(ratio, 1.0 / ratio) >= OTHER_FREQUENCY or moved > OTHER_CURRENT * span > 0.0


def _movable(rivals: Sequence[Rival], bench: Bench, specimen: Specimen, rig: Rig) -> list[Rival]:
    """Return the rivals that the rig can show; of those that a discovery states it has to be all."""
    kept = []
    for rival in rivals:
        inputs = () if rival.name == NO_MORE_RIVALS else spec_of(rival.name).inputs
        lacking = unmovable(inputs, specimen, rig)
        # what was never recorded is no part of the data that a rival has to go with
        recorded = not rival.hidden or bench.channels.issuperset(inputs)
        if not lacking and recorded:
            kept.append(rival)
        elif not rival.hidden:
            raise ConfigError(f"{rival.name} needs {lacking} to move, which [rig] does not state: add {lacking} to it")
    if len(kept) < 2:
        names = ", ".join(r.name for r in rivals if r.name != NO_MORE_RIVALS)
        raise DataError(f"no rival is left that the rig can show: [rig] moves, or the logs hold, not what {names} need")
    return kept
