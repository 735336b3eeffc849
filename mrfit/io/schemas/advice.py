"""Content of advise.json: the next test, for questions that a discovery or a fit left open."""

from dataclasses import field

from mrfit.io.schemas.reading import Document, Entry, Number, told


class Pair(Entry):
    """Two rivals: standard errors between them in the data there are, and whether the rig can tell them apart."""

    names: tuple[str, str]
    before: Number
    separable: bool


class AdvisedTest(Entry):
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
    numbers: dict[str, Number]
    seconds: Number
    waiting: Number
    distances: tuple[Number, ...] = ()
    worth: Number
    drive: str = ""


class Width(Entry):
    """A parameter with the half-width of its 95 % interval now, and expected after the test; None where open."""

    name: str
    unit: str
    value: Number
    before: Number | None
    after: Number | None


class AdviceFile(Document):
    """Content of advise.json.

    Attributes
    ----------
    goal
        ``rivals``, ``readings`` of a formula, or ``parameters``.
    model
        Base model of the discovery, or model of the fit.
    rivals, pairs
        The models or readings to separate.
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
    outdated, reason
        Whether the discovery or the fit is out of date, and why.
    """

    schema: str = "mrfit/advice/1"
    goal: str
    model: str
    rivals: tuple[str, ...] = ()
    pairs: tuple[Pair, ...] = ()
    text: tuple[str, ...]
    tests: tuple[AdvisedTest, ...]
    companion: AdvisedTest | None = None
    widths: tuple[Width, ...] = ()
    rig: dict[str, Number | tuple[Number, Number] | None] = field(default_factory=dict)
    looked_at: int
    refused: int
    noise: Number
    seed: int
    code: str = ""
    outdated: bool = told(False)
    reason: str = told("")
