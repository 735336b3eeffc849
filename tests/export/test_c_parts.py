"""Parts of an exported model: fields of its parameters, room for late values, the stroke's middle, ranges."""

import math
from dataclasses import replace

import numpy as np
import pytest

from mrfit.core import registry
from mrfit.core.specs import Array
from mrfit.export.c_parts import FASTEST, SPARE, base_fields, checkable, law_of, parts_of, stated
from mrfit.export.source import ExportSource
from mrfit.simulate.current_dependence import CurrentDependence, orders_of
from tests.export.rigs import rig


def test_fields_of_a_base_have_all_its_values_as_they_are_stored() -> None:
    spec = registry.load("model", "boucwen").SPEC
    dependence = CurrentDependence(orders_of(spec, "alpha=plain2,kappa=log1"), 0.2, 1.4)
    source = rig("boucwen", dependence, seconds=0.05)
    fields = base_fields(source, [])
    assert [q.name for q in fields] == [p.name for p in spec.params]
    # one behind another they are all parameters
    assert [v for q in fields for v in q.values] == source.base_theta.tolist()
    assert [q.first for q in fields] == np.cumsum([0, *(q.count for q in fields[:-1])]).tolist()
    own = {q.name: q for q in fields}
    assert own["alpha"].count == 3 and not own["alpha"].log and own["alpha"].stored == "alpha"
    assert own["kappa"].count == 2 and own["kappa"].log and own["kappa"].stored == "ln_kappa"
    assert [float(v) for v in own["kappa"].initial] == np.log(own["kappa"].values).tolist()
    assert [float(v) for v in own["alpha"].initial] == own["alpha"].values
    # a logarithm needs no bounds, and what does not depend on current is within its own
    assert own["kappa"].clip is None and own["n"].clip is None and own["n"].count == 1


def test_only_parameters_with_a_role_that_effects_scale_have_one() -> None:
    def roles(model: str) -> dict[str, str]:
        context = parts_of(rig(model, seconds=0.05)).context
        return {q.name: q.role for q in context.base if q.role}

    assert roles("tanh+inertia") == {}
    assert roles("tanh+temperature") == {"fy": "yield", "c": "viscous"}


def test_an_effect_on_roles_that_no_parameter_has_is_left_out() -> None:
    spec = registry.load("model", "polynomial").SPEC
    assert not {p.role for p in spec.params} & {"yield", "viscous"}
    source = rig("polynomial+temperature", seconds=0.05)
    assert not parts_of(source).context.effects and len(source.links) == 1


@pytest.mark.parametrize(
    ("model", "changes", "longest"),
    [
        ("tanh", {}, None),
        ("tanh+delay", {"delay.tau": 0.01, "delay.s": 0.3}, 0.007),
        ("tanh+delay", {"delay.tau": 0.0, "delay.s": 0.3}, 0.0),
        ("tanh+delay", {"delay.tau": -0.01, "delay.s": 0.3}, 0.0),
    ],
)
def test_late_values_have_room_for_the_longest_age_at_the_fastest_steps(
    model: str, changes: dict[str, float], longest: float | None
) -> None:
    found = parts_of(rig(model, seconds=0.05, changes=changes)).context.ring
    assert found == (0 if longest is None else math.ceil(round(longest * FASTEST, 6)) + SPARE)


def test_parameters_that_can_be_set_have_room_for_the_longest_age_within_their_bounds() -> None:
    source = rig("tanh+delay", seconds=0.05, changes={"delay.tau": 0.0})
    tau, share = registry.load("effect", "delay").SPEC.params
    # the age is tau (1 - s), s not below 0, and greatest at the upper bound of the one and the lower of the other
    ages = [tau.high * (1.0 - max(s, 0.0)) for s in (share.low, share.high)]
    assert parts_of(source, tunable=True).context.ring == math.ceil(round(max(ages) * FASTEST, 6)) + SPARE


def strokes(*middles: float) -> ExportSource:
    """Return a model that sees the stroke less its middle, with a log about each of several middles."""
    source = rig("tanh+velocity-hysteresis", seconds=0.2)
    (log,) = source.stretches

    def about(middle: float) -> Array:
        return np.full(len(log.measured), middle)

    logs = tuple(replace(log, inputs={**log.inputs, "displacement": about(m)}) for m in middles)
    return replace(source, stretches=logs)


def test_the_middle_of_a_stroke_is_that_of_a_log_in_the_middle_of_all() -> None:
    for middles, chosen in (((0.3, 0.1, 0.2), 0.2), ((0.4, 0.3, 0.1, 0.2), 0.2), ((0.3,), 0.3), ((), 0.0)):
        source = strokes(*middles)
        (effect,) = parts_of(source).context.effects
        constant = effect.fields[-1]
        assert constant.field == "x_middle" and constant.first is None
        assert float(constant.initial) == pytest.approx(chosen, rel=1e-9)
        # on that log alone the export is the simulation
        own = [float(s.inputs["displacement"][0]) for s in checkable(source)]
        assert own == ([chosen] if middles else [])
    assert len(stated(source)) == 1 and "middle of the stroke" in stated(source)[0]


def test_a_model_that_knows_no_middle_is_checked_on_all_logs() -> None:
    source = rig("tanh", seconds=0.05)
    both = replace(source, stretches=2 * source.stretches)
    assert checkable(both) == list(both.stretches) and stated(both) == []


def test_ranges_have_room_for_rounding_and_an_acceleration_has_none() -> None:
    source = rig("tanh+inertia", seconds=0.1)
    for channel in parts_of(source).context.inputs:
        low, high = source.ranges[channel.name]
        if channel.name == "acceleration":
            assert channel.ends is None
            continue
        assert channel.ends is not None and channel.ends[0] < low and channel.ends[1] > high
        # a millionth of what there is
        assert all(
            5e-7 < room / max(abs(low), abs(high)) < 3e-6 for room in (low - channel.ends[0], channel.ends[1] - high)
        )
    blind = parts_of(replace(source, stretches=())).context.inputs
    assert all(channel.ends is None for channel in blind)


def test_places_of_parameters_of_effects_follow_those_of_the_base() -> None:
    source = rig("tanh+delay+inertia", CurrentDependence((("fy", 1),), 0.1, 1.5), seconds=0.05)
    context = parts_of(source).context
    places = [q.first for e in context.effects for q in e.fields]
    assert places == list(range(len(source.base_theta), len(source.theta))) and context.count == len(source.theta)
    assert [float(q.initial) for e in context.effects for q in e.fields] == source.theta[places].tolist()


def test_the_law_of_a_driven_mass_has_its_own_name_and_not_the_mass() -> None:
    from mrfit.simulate.assembly import assemble

    whole = assemble("bingham@force")
    source = replace(rig("bingham", seconds=0.05), assembly=whole, theta=np.array([50.0, 20.0, 3.0, 2.0]), stretches=())
    law = law_of(source)
    assert law.theta.tolist() == [50.0, 20.0, 3.0] and law.assembly.name == "bingham" and not law.is_driven
    assert law.prefix == "bingham_law" and law.stretches == ()
    parts = parts_of(source)
    assert parts.law is not None and (parts.law.p, parts.context.p) == ("bingham_law", "bingham")
    assert parts.context.count == 4 and [c.name for c in parts.context.inputs] == ["excitation_force"]
    assert parts.law.count == 3 and [c.name for c in parts.law.inputs] == ["velocity"]
