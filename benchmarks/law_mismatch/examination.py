"""The examination by invariances alone, without the rest of discovery: fast enough for many cases."""

import numpy as np

import mrfit
from benchmarks.law_mismatch.said import Name, Number, Said
from mrfit.api.preparing import as_asked, prepared
from mrfit.api.threads import one_blas_thread
from mrfit.core import registry
from mrfit.core.channels import MOTION
from mrfit.core.progress import silent
from mrfit.discover.evidence.bench import build_bench, effects_for
from mrfit.discover.evidence.refit import Fitter
from mrfit.discover.invariance.base import base_of
from mrfit.discover.invariance.examine import examine
from mrfit.discover.invariance.findings import LawFindings
from mrfit.discover.invariance.records import from_block
from mrfit.io.dataset import Dataset
from mrfit.simulate.assembly import assemble
from mrfit.simulate.current_dependence import CurrentDependence, orders_of
from mrfit.simulate.current_levels import base_of as base_alone
from mrfit.simulate.current_levels import default_orders, recorded_range

# Errors of the base over the noise from which there is something to explain
CLEAR = 1.5


def findings(recordings: list[mrfit.Recording], model: str) -> LawFindings:
    """Return what an examination finds beside a base fitted to the same recordings, its current by role."""
    with one_blas_thread():
        data = prepared(recordings, as_asked({}), silent).dataset
        dependence = _dependence(model, data)
        plain = assemble(model, dependence)
        output = plain.spec.output
        bench = build_bench(data.segments, data.recordings, plain, effects_for(output))
        lacking = [n for n in MOTION[output] if n not in bench.channels]
        if lacking:
            return LawFindings(not_applicable=f"no {lacking[0]}")
        base = Fitter(bench, model, dependence, {}, {}, lambda effects, point: None).first(0)
        records = [from_block(s.block, s.names, output) for s in bench.stretches]
        effects = [registry.load("effect", e.name) for e in effects_for(output)]
        return examine(records, base_of(base.assembly, base.theta, records), effects)


def _dependence(model: str, data: Dataset) -> CurrentDependence | None:
    spec = base_alone(model).spec
    low, high = recorded_range(data.recordings)
    if not high - low > 0.05 * abs(high):
        return None
    shape = [p.name for p in spec.params if p.role == "hysteresis"]
    return CurrentDependence(default_orders(spec, 3, shape) or orders_of(spec, "2"), low, high)


def said(found: LawFindings) -> Said:
    """Return findings in the form that is judged."""
    names = tuple(
        Name(
            e.name,
            {p.name: Number(p.value, p.low, p.high) for p in e.parameters},
            e.one_of,
        )
        for e in found.named
    )
    why = {t.name: t.reason for t in found.turned_down}
    why |= {c.name: c.reason for c in found.confounded}
    weak = {t.name: {p.name: p.value for p in t.parameters} for t in found.turned_down}
    if found.not_applicable:
        return Said("insufficient-data", why={"not applicable": found.not_applicable})
    base = found.errors.base or np.inf
    verdict = "named" if names else "unexplained" if base > CLEAR * found.errors.noise else "none"
    return Said(verdict, names, broken=tuple(str(b.invariance) for b in found.broken), why=why, weak=weak)
