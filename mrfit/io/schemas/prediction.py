"""Result of a saved prediction, as its JSON file holds it."""

from dataclasses import field

from mrfit.io.schemas.fit import Caution, MetricRow
from mrfit.io.schemas.reading import Document


class PredictionFile(Document):
    """A fit simulated on other logs.

    Attributes
    ----------
    name, fit, model, output
        Names of the prediction, the fit, the model and what it predicts.
    logs
        As they were given.
    series
        Name of the file with every sample.
    frequencies, simulated_only
        Frequency in Hz of every segment, 0 where it has none, and the segments in which the output was not measured.
    metrics
        Errors, none where nothing was measured.
    warnings, findings
        Where not to trust it, and what was odd about the logs.
    """

    schema: str = "mrfit/prediction/1"
    name: str
    fit: str
    model: str
    output: str
    logs: list[str]
    series: str
    frequencies: dict[str, float]
    simulated_only: list[str] = field(default_factory=list)
    metrics: list[MetricRow] = field(default_factory=list)
    warnings: list[Caution] = field(default_factory=list)
    findings: list[str] = field(default_factory=list)
