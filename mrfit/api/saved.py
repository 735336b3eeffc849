"""Loading of saved results."""

from pathlib import Path

from mrfit.api import fitting
from mrfit.api.discovery import Discovery
from mrfit.api.fitting import FitResult
from mrfit.api.recordings import PathText
from mrfit.core.arguments import check_arguments
from mrfit.errors import DataError
from mrfit.io.schemas import reading
from mrfit.io.schemas.discovery import DiscoveryFile
from mrfit.io.workspace import read_json

DISCOVERY = "mrfit/discovery/"


@check_arguments
def load(path: PathText) -> FitResult | Discovery:
    """Return a fit or a discovery that its ``save``, or the command, wrote (``fit.json``, ``discovery.json``).

    Of a fit that the command wrote the coil resistance is not known: logs that state none have it estimated.

    Raises
    ------
    DataError
        If there is no such file, it is damaged, or of an unknown schema.
    """
    whole = read_json(Path(path))
    damaged = whole is None and (not Path(path).is_file() or _begins_as_json(Path(path)))
    if not damaged and not isinstance(whole, dict):
        raise DataError(f"{path}: neither a fit nor a discovery; give its fit.json or discovery.json")
    if isinstance(whole, dict) and str(whole.get("schema", "")).startswith(DISCOVERY):
        found = reading.load(Path(path), DiscoveryFile, "run `mrfit discover` again")
        assert found is not None  # it was read a moment ago
        return Discovery(found)
    return fitting.load(path)


def _begins_as_json(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(100).lstrip().startswith(b"{")
