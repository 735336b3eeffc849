"""What advise.json holds: the next test, from what a discovery or a fit left open."""

from pydantic import ConfigDict

from mrfit.io.schemas.reading import Part, Stored

SCHEMA = "mrfit/advice/1"


class Row(Part):
    """A part of an advice, which nobody changes."""

    model_config = ConfigDict(frozen=True)


class Pair(Row):
    """Two rivals: standard errors between them in the data there are, and whether the rig can tell them apart."""

    names: tuple[str, str]
    before: float
    separable: bool


class AdvisedTest(Row):
    """A test that a rig can run.

    Attributes
    ----------
    kind
        Kind of test.
    text
        The same in words.
    numbers
        Its frequency in Hz, amplitude, currents in A, times in s.
    seconds, waiting
        How long it drives, and what it waits for beside that.
    distances
        Standard errors that it puts between each pair, in the mean over draws of the parameters; of parameters none.
    worth
        The least squared distance of a separable pair, or the gain in information, per second.
    drive
        File with the drive, in the folder of the advice.
    """

    kind: str
    text: str
    numbers: dict[str, float]
    seconds: float
    waiting: float
    distances: tuple[float, ...] = ()
    worth: float
    drive: str = ""


class Width(Row):
    """A parameter with the half-width of its 95 % interval now, and expected after the test; None where open."""

    name: str
    unit: str
    value: float
    before: float | None
    after: float | None


class AdviceFile(Stored):
    """Content of advise.json.

    Attributes
    ----------
    goal
        ``rivals`` or ``parameters``.
    model
        Base model of the discovery, or model of the fit.
    rivals, pairs
        The models to separate.
    text
        What to do, in sentences.
    tests
        The best test of each kind, the best first.
    companion
        A second test of the kind of the best one, that can be held out.
    widths
        Parameters of the fit.
    rig
        The limits, SI.
    looked_at, refused
        Tests simulated, and those among them that the rig cannot run after all.
    noise
        Standard error of one sample of the output, SI.
    """

    known = (SCHEMA,)
    model_config = ConfigDict(frozen=True)

    goal: str
    model: str
    rivals: tuple[str, ...] = ()
    pairs: tuple[Pair, ...] = ()
    text: tuple[str, ...]
    tests: tuple[AdvisedTest, ...]
    companion: AdvisedTest | None = None
    widths: tuple[Width, ...] = ()
    rig: dict[str, float | tuple[float, float] | None] = {}
    looked_at: int
    refused: int
    noise: float
    seed: int
    code: str = ""
