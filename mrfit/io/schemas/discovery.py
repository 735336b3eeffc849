"""What discovery.json holds, and what is kept of an unfinished discovery."""

from typing import Any, Self

from pydantic import model_validator

from mrfit.io.schemas.reading import Part, Stored


class EffectParameter(Part):
    """A parameter of an effect with its interval."""

    name: str
    unit: str
    value: float
    low: float | None
    high: float | None


class FoundEffect(Part):
    """An effect that a discovery names."""

    name: str
    parameters: list[EffectParameter]
    holdout_nrmse_before: float | None
    holdout_nrmse_after: float | None


class Suspect(Part):
    """An effect that a discovery does not name, and what it would take of the gap."""

    name: str
    parameters: list[EffectParameter]
    holdout_nrmse_after: float | None
    closed: float | None = None


class Where(Part):
    """A region with its shares of the squared error and of the samples."""

    region: str
    share_of_error: float
    share_of_samples: float


class Gap(Part):
    """Noise floor and errors as shares of the output's range."""

    noise_floor: float | None
    before: float | None
    after: float | None
    closed: float | None


class Unexplained(Part):
    """What is left of the gap."""

    share_of_gap: float | None
    where: list[Where] = []
    text: list[str] = []
    looks_text: str = ""


class Candidate(Part):
    """What became of an effect of the library."""

    name: str
    screen: float
    holdout_gain: float | None
    accepted: bool
    reason: str


class Cosines(Part):
    """Cosines between what effects do, a square matrix."""

    names: list[str]
    matrix: list[list[float]]
    alike: float = 1.0

    @model_validator(mode="after")
    def _square(self) -> Self:
        sizes = {len(self.names), len(self.matrix), *map(len, self.matrix)}
        if len(sizes) > 1:
            raise ValueError("cosines: the matrix does not go with the names")
        return self


class SegmentFloor(Part):
    """A segment of a discovery with its noise floor."""

    id: str
    condition: str
    role: str
    noise_floor: float | None = None


class DiscoveryDependence(Part):
    """How the base's parameters depend on current."""

    orders: list[tuple[str, int | str]]
    low: float
    high: float


class DiscoveryFile(Stored):
    """Content of discovery.json."""

    known = ("mrfit/discovery/1",)
    base_model: str
    verdict: str
    effects: list[FoundEffect]
    ambiguous_set: list[str]
    suspects: list[Suspect] = []
    advice: list[str]
    where: list[Where]
    where_text: list[str] = []
    beyond_training: list[str] = []
    gap: Gap
    candidates: list[Candidate]
    cosines: Cosines | None = None
    unexplained: Unexplained
    augmented_model: str
    segments: list[SegmentFloor] = []
    current_dependence: DiscoveryDependence | None = None
    seed: int
    data_sha256: str
    key: str
    code: str = ""
    settings: dict[str, Any] = {}

    @model_validator(mode="after")
    def _complete(self) -> Self:
        judged = self.verdict != "insufficient-data"
        if judged and None in (self.gap.before, self.gap.after):
            raise ValueError("gap: no errors for this verdict")
        known = {s.name for s in self.suspects}
        for suspect in self.suspects:
            other = (suspect.model_extra or {}).get("instead_of")
            if "instead_of" in (suspect.model_extra or {}) and (not isinstance(other, str) or other not in known):
                raise ValueError(f"suspects: '{other}', instead of which '{suspect.name}' may stand, is none of them")
        return self


class PartialPoint(Part):
    """The point that a refit with some effects ended at."""

    effects: list[str]
    point: list[float]


class PartialDiscovery(Stored):
    """The refits of an unfinished discovery."""

    key: str
    fits: list[PartialPoint]
