"""The test that narrows the intervals of a fit most, by D-optimality of the linearised fit."""

from dataclasses import dataclass

import numpy as np

from mrfit.advise.choose import ScoredTest, Task, TestChoice, choose
from mrfit.advise.criterion import determinant_gain, half_widths, triangle, without
from mrfit.advise.drives import RigBench as Rigged
from mrfit.advise.drives import Test
from mrfit.advise.specimen import Specimen, rows_of
from mrfit.advise.standing import PRIOR, errors_of, stencil, stride_of
from mrfit.core.progress import Progress, silent
from mrfit.core.specs import Array
from mrfit.discover.evidence.bench import Bench
from mrfit.errors import ConfigError
from mrfit.fit.diagnostics.uncertainty import sensitivities
from mrfit.io.schemas.advice import Width
from mrfit.io.schemas.fit import Fit
from mrfit.search.cube import Cube, cube_of
from mrfit.simulate.assembly import Assembly
from mrfit.simulate.current_levels import assembly_of


@dataclass(frozen=True)
class ParameterInformation:
    """A fit about its optimum.

    Attributes
    ----------
    assembly, cube
        The model and its free parameters.
    point
        Its optimum (F,) in the cube.
    root
        Triangle (F, F) of the data's sensitivities in standard errors.
    prior
        Standard deviations (F,) that bounds alone leave.
    noise
        RMS error of the fit, in the output's unit.
    """

    assembly: Assembly
    cube: Cube
    point: Array
    root: Array
    prior: Array
    noise: float

    def jacobian(self, test: Test, specimen: Specimen) -> Array:
        """Return sensitivities (N, F) on a test, in standard errors."""
        points, steps = stencil(self.point)
        channels = specimen.driven(test)
        with np.errstate(all="ignore"):
            cold = self.assembly.simulate(rows_of(channels, self.assembly), self.cube.to_theta(points[:1]), test.dt)[0]
            warm = specimen.heated(channels, cold, test.dt)
            rows = self.assembly.simulate(rows_of(warm, self.assembly), self.cube.to_theta(points), test.dt)
        columns: Array = ((rows[1:] - rows[0]) / steps[:, None]).T / self.noise
        if self.assembly.spec.free_offset:
            columns = without(columns, np.ones((len(columns), 1)))
        return columns


def known_of(bench: Bench, fit: Fit) -> ParameterInformation:
    """Return a fit about its optimum.

    Raises
    ------
    ConfigError
        If it has parameters of its own for every condition, which a new test does not share.
    """
    if len(fit.results) != 1:
        raise ConfigError(
            f"fit '{fit.name}' has parameters for each condition, which a new test does not share; fit with --per all"
        )
    assembly, found = assembly_of(fit), {q.name: q for q in fit.results[0].parameters}
    held = {n: q.value for n, q in found.items() if q.fixed}
    free = {n: q for n, q in found.items() if not q.fixed}
    specs = {p.name: p for p in assembly.spec.params}
    ends = {
        n: (
            specs[n].low if q.bound_low is None else q.bound_low,
            specs[n].high if q.bound_high is None else q.bound_high,
        )
        for n, q in free.items()
    }
    cube = cube_of(assembly.spec, ends, {n: q.value for n, q in free.items()}, held)
    point = cube.start
    evaluate = errors_of(bench, assembly, cube)
    excess = max(float(np.sqrt(np.mean(evaluate(point[None, :]) ** 2) / stride_of(bench))), 1.0)
    root = triangle(sensitivities(evaluate, point) / excess)
    floor = float(np.sqrt(np.mean([s.floor**2 for s in bench.of_role("train")])))
    return ParameterInformation(assembly, cube, point, root, np.full(len(point), PRIOR), floor * excess)


def narrow(
    known: ParameterInformation, specimen: Specimen, rigged: Rigged, seed: int, progress: Progress = silent
) -> TestChoice:
    """Return the tests that narrow the intervals of a fit most per second."""
    most = rigged.rig.force

    def judge(test: Test) -> ScoredTest | None:
        channels = specimen.driven(test)
        with np.errstate(all="ignore"):
            theta = known.cube.to_theta(known.point[None, :])
            output = known.assembly.simulate(rows_of(channels, known.assembly), theta, test.dt)[0]
        if not np.isfinite(output).all() or most is not None and specimen.channels.rate and np.abs(output).max() > most:
            return None
        jacobian = known.jacobian(test, specimen)
        if not np.isfinite(jacobian).all():
            return None
        gain = determinant_gain(known.root, jacobian, known.prior)
        return ScoredTest(test, np.array([np.sqrt(max(gain, 0.0))]))

    return choose(Task(rigged, judge, lambda most: most > 0.0, rigged.kinds, enough=0.0), seed, progress)


def widths(known: ParameterInformation, fit: Fit, test: Test, specimen: Specimen) -> tuple[Width, ...]:
    """Return the half-widths of the fit's intervals, and those expected after a test.

    An interval shrinks by the share by which the linearised standard error does, so that what the fit allowed for
    correlated noise stays in it.
    """
    before = half_widths([known.root], known.prior)
    after = half_widths([known.root, known.jacobian(test, specimen)], known.prior)
    found = {q.name: q for q in fit.results[0].parameters}
    rows = []
    for at, k in enumerate(known.cube.free):
        q = found[known.cube.params[k].name]
        width = None if q.low is None or q.high is None else 0.5 * (q.high - q.low)
        slope = float(known.cube.slopes(known.cube.to_theta(known.point[None, :]))[0, at])
        linear = 1.96 * slope * float(after[at])
        expected = linear if width is None else width * float(after[at] / before[at])
        rows.append(Width(name=q.name, unit=q.unit, value=float(q.value), before=width, after=expected))
    return tuple(rows)
