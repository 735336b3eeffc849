"""Content of discovery.json, the result of a discovery, and the records of an unfinished one."""

from typing import Any, Self

from pydantic import ConfigDict, Field, model_validator

from mrfit.core.invariance import Invariance
from mrfit.io.schemas.reading import Entry, Part, Stored

DISCOVERY_SCHEMA = "mrfit/discovery/2"
# The first had no examination by invariances
EARLIER_SCHEMA = "mrfit/discovery/1"


class Row(Part):
    """A part of a discovery, which nobody changes."""

    model_config = ConfigDict(frozen=True, populate_by_name=True)


class EffectParameter(Entry):
    """A parameter of an effect with its 95 % interval; None where the data leave an end open."""

    name: str
    unit: str
    value: float
    low: float | None
    high: float | None


class FoundEffect(Row):
    """An effect that a discovery names, those it looks like in these data, and the errors without and with it."""

    name: str
    parameters: tuple[EffectParameter, ...]
    aliases: tuple[str, ...] = ()
    holdout_nrmse_before: float | None
    holdout_nrmse_after: float | None


class Suspect(Row):
    """An effect that a discovery does not name, and what it would take of the gap.

    ``instead_of`` is the effect in whose place it would stand, where that was taken back too.
    """

    name: str
    parameters: tuple[EffectParameter, ...]
    holdout_nrmse_after: float | None
    closed: float | None = None
    instead_of: str = ""


class Where(Row):
    """A region with its shares of the squared error and of the samples."""

    region: str
    share_of_error: float
    share_of_samples: float


class Gap(Row):
    """Noise floor and errors as shares of the output's range, and the share of the gap closed.

    Attributes
    ----------
    noise_floor, before, after, closed
        Of fits that weigh every segment by its noise floor, with the roles that a discovery gives the conditions.
    plain_before, plain_after
        Errors on held-out conditions that fits of both models to all conditions state, in which every sample weighs
        alike; None where one cannot be made.
    """

    noise_floor: float | None
    before: float | None
    after: float | None
    closed: float | None
    plain_before: float | None = None
    plain_after: float | None = None


class Drifting(Row):
    """A record that drifts steadily, at rates in the output's unit and as a share per second, or an effect follows."""

    condition: str
    segment: str
    level_rate: float = 0.0
    gain_rate: float = 0.0
    follows: str = ""
    rate: float = 0.0


class Candidate(Row):
    """Result of an effect of the library."""

    name: str
    screen: float
    strength: float = 0.0
    holdout_gain: float | None
    accepted: bool
    reason: str


class Pair(Row):
    """Two effects that look alike in these data, and the cosine between what they do."""

    pair: tuple[str, str]
    cosine: float


class Cosines(Row):
    """Cosines between what effects do, a square matrix."""

    names: tuple[str, ...]
    matrix: tuple[tuple[float, ...], ...]
    alike: float = 1.0

    @model_validator(mode="after")
    def _square(self) -> Self:
        sizes = {len(self.names), len(self.matrix), *map(len, self.matrix)}
        if len(sizes) > 1:
            raise ValueError("cosines: the matrix does not go with the names")
        return self


class Look(Row):
    """Shares of the squared hold-out error that shapes over a channel predict; negative where that is nothing."""

    over: str
    curve: float
    loop: float
    since_it_turned: float = Field(alias="since it turned")


class Unexplained(Row):
    """Rest of the gap."""

    share_of_gap: float | None
    predictable: float | None = None
    where: tuple[Where, ...] = ()
    text: tuple[str, ...] = ()
    looks: tuple[Look, ...] = ()
    looks_text: str = ""


class SegmentFloor(Row):
    """A segment of a discovery with its noise floor."""

    id: str
    condition: str
    role: str
    noise_floor: float | None = None
    noise_floor_method: str = ""
    noise_floor_bounds: tuple[float | None, float | None] = (None, None)


class DiscoveryDependence(Row):
    """Dependence of the base's parameters on current."""

    orders: tuple[tuple[str, int | str], ...]
    low: float
    high: float


class LawPlace(Entry):
    """A part of the samples, a bin of ``over``, and the share of the law's squared error that lies in it.

    ``over`` is ``travel`` since the motion turned, ``speed`` or ``control``; the bin is in SI.
    """

    over: str
    low: float
    high: float
    unit: str
    share_of_error: float
    share_of_samples: float


class LawGap(Row):
    """Error of the base's law itself, effects put aside.

    Attributes
    ----------
    error
        RMS error over the output's range.
    share, effects, rest
        Shares of the base's squared error beyond noise: the law's, that of the effects named, and what neither makes.
    left
        RMS error that no law and no effect named makes, over the output's range.
    taken
        Share that the effects named take of the squared error that no law makes.
    where, text, looks
        Where it lies, the same in words, and how it looks.
    """

    error: float
    share: float
    effects: float
    rest: float
    left: float
    taken: float
    where: tuple[LawPlace, ...] = ()
    text: tuple[str, ...] = ()
    looks: str = ""


class Confounded(Entry):
    """An effect that the law could imitate on these data, why, and the test that would separate them."""

    name: str
    reason: str
    test: str


class EffectSignificance(Entry):
    """Significance of an effect beside the best law.

    Attributes
    ----------
    share
        Of the squared error that no law makes, how much the effect takes.
    kept
        The same on conditions left out, the effect's value from the others, the law from all.
    held
        The same with the law from the others too, of a typical condition: the geometric mean.
    size
        Largest force of the effect over the range of the output.
    z
        Standard errors of its strength from neutral: scatter over conditions and over nuisances.
    left
        Share of its sensitivity's square that no law takes.
    improved
        Share of the conditions that are predicted better with it.
    """

    share: float
    kept: float
    held: float
    size: float
    z: float
    left: float
    improved: float


class InvariantEffect(Row):
    """An effect that stands whatever the law is, as long as the law keeps what ``tier`` says, or why it does not.

    Attributes
    ----------
    name, breaks, tier
        The effect, the invariance that it breaks, and what has to hold for the name.
    parameters
        Its parameters; those of a common factor are all the same. Of one that does not stand, its strength to first
        order, beside what is named; no interval.
    force
        Its largest force with its 95 % interval, which the data may tell better than single parameters.
    standing
        How clearly it shows; None where screening was enough.
    one_of
        Effects tested in its place that leave nearly as little, and those that are in the span of every law but would
        make its mark too: the name is one of a set.
    reason
        Why it does not stand.
    """

    name: str
    breaks: Invariance
    tier: str = ""
    parameters: tuple[EffectParameter, ...] = ()
    force: EffectParameter | None = None
    standing: EffectSignificance | None = None
    one_of: tuple[str, ...] = ()
    reason: str = ""


class BrokenInvariance(Entry):
    """An invariance that is broken by something that no effect of the library describes.

    Attributes
    ----------
    invariance
        Which one.
    share, kept
        Of the squared error beside the named effects, how much flexible terms take; the same on conditions left out.
    size
        Largest force of these terms over the range of the output.
    """

    invariance: Invariance
    share: float
    kept: float
    size: float


class Examination(Row):
    """Findings that hold under any law.

    Attributes
    ----------
    not_applicable
        Why nothing was examined; empty otherwise.
    named, turned_down
        Effects that stand, and those that were tested and do not.
    broken
        Invariances broken by something without a name.
    travel, travel_unit, time
        Horizon of travel and time (s) within which a law was let remember.
    base, law, after, noise
        RMS errors over the output's range: of the base, of the best law, with the effects named, and noise.
    """

    not_applicable: str = ""
    named: tuple[InvariantEffect, ...] = ()
    turned_down: tuple[InvariantEffect, ...] = ()
    broken: tuple[BrokenInvariance, ...] = ()
    travel: float = 0.0
    travel_unit: str = ""
    time: float = 0.0
    base: float | None = None
    law: float = 0.0
    after: float = 0.0
    noise: float = 0.0


class Way(Row):
    """Result of one way of discovery on its own."""

    verdict: str
    effects: tuple[str, ...] = ()
    ambiguous_set: tuple[str, ...] = ()


class Ways(Row):
    """Whether the base taken as exact and the invariances agree, and how they differ."""

    exact_base: Way
    invariances: Way
    agree: bool
    difference: str = ""


class OtherLaw(Row):
    """Another base and the share of the gap that it takes on held-out conditions, and where the effects are held.

    Attributes
    ----------
    model
        Its name.
    holdout_nrmse
        Its error on held-out conditions.
    takes, takes_beside
        Share of the base's gap it takes, alone and with the effects named held at their values; None without effects.
    floors
        Its error, effects held, in multiples of the noise floor; None where that is not known.
    near_the_floor
        Whether that is so little that it may be taken as exact.
    command
        That looks for what this law lacks.
    """

    model: str
    holdout_nrmse: float | None
    takes: float
    takes_beside: float | None = None
    floors: float | None = None
    near_the_floor: bool = False
    command: str


class OtherBase(Row):
    """Effects that another law lacks, which errs so little that it was taken as exact."""

    model: str
    verdict: str
    effects: tuple[FoundEffect, ...] = ()
    ambiguous_set: tuple[str, ...] = ()
    gap: Gap


class FormulaRange(Row):
    """A variable of a formula, and the range that was visited, in SI."""

    symbol: str
    channel: str
    unit: str
    low: float
    high: float


class FormulaScale(Row):
    """Origin and size in SI of a variable of a formula: scaled it is (u - origin)/size."""

    symbol: str
    origin: float
    size: float


class FormulaFactor(Row):
    """A factor of a term: its variable, its kind, and its constants."""

    variable: str
    kind: str
    constants: tuple[float, ...] = ()


class FormulaTerm(Row):
    """A term with its coefficient, force over the output's range, of scaled variables."""

    factors: tuple[FormulaFactor, ...]
    coefficient: float


class FormulaReading(Row):
    """A reading of a formula: in SI, and by its terms."""

    text: str
    terms: tuple[FormulaTerm, ...]


class ProposedFormula(Row):
    """A formula for what no law makes and no effect describes, or why none is proposed.

    Attributes
    ----------
    reason
        Why none is proposed; empty if one is.
    text, coefficients
        The formula in SI, and its coefficients with 95 % intervals, the constants as they are.
    file, source
        The formula as a plug-in: its name beside discovery.json, and its text.
    alike
        Formulas that the data do not tell from it.
    law, after, closed
        Errors of the best law on held-out conditions over the output's range, without and with the formula, and the
        share of the squared error beyond noise that it takes; None without such conditions.
    kept, clear
        Share of what no law makes that it takes on conditions left out, and the standard errors of its least clear
        coefficient.
    left
        Share of its force that no law makes: only this part is known.
    box
        Ranges of its variables within which it holds.
    readings, scales
        The formula and those that the data do not tell from it, term by term, and the scales of their variables.
    """

    reason: str = ""
    text: str = ""
    file: str = ""
    source: str = ""
    coefficients: tuple[EffectParameter, ...] = ()
    alike: tuple[str, ...] = ()
    law: float | None = None
    after: float | None = None
    closed: float | None = None
    kept: float = 0.0
    clear: float = 0.0
    left: float = 0.0
    box: tuple[FormulaRange, ...] = ()
    readings: tuple[FormulaReading, ...] = ()
    scales: tuple[FormulaScale, ...] = ()


class LawRepair(Row):
    """Terms that the law of the base lacks, or why none is known.

    Attributes
    ----------
    reason
        Why none is proposed; empty if some are.
    titles, coefficients
        Kinds of the terms in words, and their strengths in SI with 95 % intervals, the constants as they are.
    alike
        Kinds of terms that would do as well in place of the first.
    file, source
        The terms as a plug-in: its name beside discovery.json, and its text.
    takes, chance
        Share of the squared error on conditions left out that the first term takes, and the most that the same terms
        take which are shifted in time.
    before, after
        Errors on held-out conditions over the output's range, of the base and with the terms; None without any.
    other_law, other_error
        Base that leaves least there, and its error; None where none was fitted.
    """

    reason: str = ""
    titles: tuple[str, ...] = ()
    coefficients: tuple[EffectParameter, ...] = ()
    alike: tuple[str, ...] = ()
    file: str = ""
    source: str = ""
    takes: float = 0.0
    chance: float = 0.0
    before: float | None = None
    after: float | None = None
    other_law: str = ""
    other_error: float | None = None


class DiscoveryFile(Stored):
    """Content of discovery.json, the result of a discovery."""

    model_config = ConfigDict(frozen=True)
    known = (DISCOVERY_SCHEMA, EARLIER_SCHEMA)
    base_model: str
    verdict: str
    effects: tuple[FoundEffect, ...]
    ambiguous_set: tuple[str, ...]
    suspects: tuple[Suspect, ...] = ()
    advice: tuple[str, ...]
    where: tuple[Where, ...]
    where_text: tuple[str, ...] = ()
    beyond_training: tuple[str, ...] = ()
    gap: Gap
    drift: tuple[Drifting, ...] = ()
    candidates: tuple[Candidate, ...]
    confusable: tuple[Pair, ...] = ()
    cosines: Cosines | None = None
    unexplained: Unexplained
    law_gap: LawGap | None = None
    confounded: tuple[Confounded, ...] = ()
    invariance: Examination | None = None
    ways: Ways | None = None
    other_laws: tuple[OtherLaw, ...] = ()
    left_out: tuple[str, ...] = ()
    other_base: OtherBase | None = None
    proposed: ProposedFormula | None = None
    lacking: LawRepair | None = None
    augmented_model: str
    held: tuple[tuple[str, float], ...] = ()
    segments: tuple[SegmentFloor, ...] = ()
    seed: int
    data_sha256: str
    current_dependence: DiscoveryDependence | None = None
    current_choice: dict[str, Any] | None = None
    key: str
    code: str = ""
    segments_sha256: str = ""
    settings: dict[str, Any] = {}

    @model_validator(mode="after")
    def _complete(self) -> Self:
        judged = self.verdict != "insufficient-data"
        if judged and None in (self.gap.before, self.gap.after):
            raise ValueError("gap: no errors for this verdict")
        known = {s.name for s in self.suspects}
        for suspect in self.suspects:
            if "instead_of" in suspect.model_fields_set and suspect.instead_of not in known:
                other = suspect.instead_of
                raise ValueError(f"suspects: '{other}', instead of which '{suspect.name}' may stand, is none of them")
        return self

    @property
    def driven(self) -> dict[str, str]:
        """Settings by which a mass is driven, by name; none where no mass is."""
        own = {name: str(self.settings.get(name, "none")) for name in ("driven_by", "mass")}
        return own if own["driven_by"] != "none" else {}

    def to_json(self) -> dict[str, Any]:
        """Return the file's content as JSON has it, without what was never set."""
        whole = self.model_dump(mode="json", by_alias=True, exclude_unset=True)
        return {"schema": whole.pop("schema", DISCOVERY_SCHEMA), **whole}


class PartialPoint(Part):
    """The point that a refit with some effects ended at."""

    effects: list[str]
    point: list[float]


class PartialDiscovery(Stored):
    """The refits of an unfinished discovery."""

    key: str
    fits: list[PartialPoint]
