"""Data of the bands of a prediction, as fit.json keeps them."""

from dataclasses import field

from mrfit.io.schemas.reading import Entry


class Refits(Entry):
    """Parameters beside the optimum, whose scatter says what the data leave open of an output.

    Attributes
    ----------
    names
        The parameters that were fitted, in the order of the columns.
    rows
        A vector of values a row, SI: of refits without one test each, or about the optimum by its covariance.
    factor
        Of the variance of an output over the rows, that makes it the output's.
    degrees
        Degrees of freedom of Student's t.
    """

    names: list[str]
    rows: list[list[float]]
    factor: float
    degrees: float


class Remainder(Entry):
    """Residual of a model in one test: noise and its own error together.

    Attributes
    ----------
    condition, role
        Of which data: ``train`` and ``holdout`` by the fit, ``left-out`` by one without them,
        ``level-left-out`` by one without any test of their current.
    quantile
        Magnitude that 95 of 100 residuals do not exceed, in the output's unit.
    reach
        Range of the simulated output.
    independent
        How many independent samples the residuals are worth, by their colour.
    extents
        Least and greatest value of every channel.
    beyond
        How far these lie beyond the tests that were fitted, see ``mrfit.fit.extrapolation.beyond``.
    share
        Of a test: stretches of one random motion are together one test.
    """

    condition: str
    role: str
    quantile: float
    reach: float
    independent: float
    extents: dict[str, tuple[float, float]] = field(default_factory=dict)
    beyond: float = 0.0
    share: float = 1.0
