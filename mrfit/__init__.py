"""From laboratory logs of magnetorheological dampers and their coils to identified models.

``read`` logs or make a ``Recording`` of arrays or of a data frame; then ``fit``, ``predict``, ``discover`` and
``compare``. ``models`` lists the models, ``load`` reads a fit or a discovery that was saved. A name is loaded at its
first use.
"""

import sys
from types import ModuleType

TYPE_CHECKING = False
if TYPE_CHECKING:
    from mrfit.api.advice import Advice, advise
    from mrfit.api.catalog import models
    from mrfit.api.comparison import Comparison, OptimizerComparison, compare
    from mrfit.api.discovery import Discovery, discover
    from mrfit.api.fitting import FitResult, fit, predict
    from mrfit.api.prediction import Prediction
    from mrfit.api.recordings import Recording, read
    from mrfit.api.saved import load
    from mrfit.api.sheet import Sheet, sheet
    from mrfit.core.plugins import model
    from mrfit.core.specs import Param
    from mrfit.drift.call import UnitComparison, drift
    from mrfit.errors import ConfigError, DataError, MrfitError
    from mrfit.track.call import ParameterTracks, track

__all__ = [
    "Advice",
    "Comparison",
    "ConfigError",
    "DataError",
    "Discovery",
    "FitResult",
    "MrfitError",
    "OptimizerComparison",
    "Param",
    "ParameterTracks",
    "Prediction",
    "Recording",
    "Sheet",
    "UnitComparison",
    "advise",
    "compare",
    "discover",
    "drift",
    "fit",
    "load",
    "model",
    "models",
    "predict",
    "read",
    "sheet",
    "track",
]

# Where each name is defined
_HOMES = {
    "api.advice": ("Advice", "advise"),
    "api.catalog": ("models",),
    "api.comparison": ("Comparison", "OptimizerComparison", "compare"),
    "api.discovery": ("Discovery", "discover"),
    "api.fitting": ("FitResult", "fit", "predict"),
    "api.prediction": ("Prediction",),
    "api.recordings": ("Recording", "read"),
    "api.saved": ("load",),
    "api.sheet": ("Sheet", "sheet"),
    "core.plugins": ("model",),
    "core.specs": ("Param",),
    "drift.call": ("UnitComparison", "drift"),
    "track.call": ("ParameterTracks", "track"),
    "errors": ("ConfigError", "DataError", "MrfitError"),
}
_HOME = {name: home for home, names in _HOMES.items() for name in names}
# What `mrfit.apply` offers, by the module of that room it is in
_APPLIED = {
    name: home
    for home, names in {
        "calls": ("invert", "quarter_car", "track"),
        "car": ("Car", "Control", "Timing"),
        "coil": ("Coil", "CoilDrive", "coil", "current_of_flux", "flux_command"),
        "damper": ("Damper", "damper"),
        "inverse": ("Amplifier",),
        "motion": ("sine",),
        "roads": ("road",),
    }.items()
    for name in names
}
# Functions that a room of the package has the name of: the name of the package is the function's
_ROOMS = ("advise", "compare", "discover", "drift", "fit", "models", "sheet", "track")


def _of_face(name: str) -> object:
    from importlib import import_module

    found = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    if name in _ROOMS:
        # `mrfit.fit.stage` is found through the function as well
        room = vars(import_module(f"{__name__}.{name}"))
        room.update(vars(found))
        found.__dict__ = room
    return found


class _ApplyRoom(ModuleType):
    """The room ``apply``, whose functions are found in its modules: ``mrfit.apply.invert(…)``."""

    def __getattr__(self, name: str) -> object:
        from importlib import import_module

        if name not in _APPLIED:
            raise AttributeError(f"module '{self.__name__}' has no attribute '{name}'")
        return getattr(import_module(f"{self.__name__}.{_APPLIED[name]}"), name)

    def __setattr__(self, name: str, value: object) -> None:
        # a module that a function has the name of stays the function's, as in the package
        if not (isinstance(value, ModuleType) and name in _APPLIED):
            super().__setattr__(name, value)

    def __dir__(self) -> list[str]:
        return sorted(_APPLIED)


class _Package(ModuleType):
    """The package itself, where the import system sets no room that a function has the name of."""

    def __setattr__(self, name: str, value: object) -> None:
        if isinstance(value, ModuleType):
            if name in _ROOMS:
                return
            if name == "apply":
                value.__class__ = _ApplyRoom
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


def __getattr__(name: str) -> object:
    from importlib import import_module

    if name == "__version__":
        from importlib.metadata import version

        return version(__name__)
    if name == "apply":
        return import_module(f"{__name__}.{name}")
    if name not in _HOME:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    value = _of_face(name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*__all__, "__version__", *(n for n in globals() if n.startswith("__"))})
