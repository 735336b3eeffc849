"""Models that can be fitted."""

from typing import TYPE_CHECKING

from mrfit.core import registry

if TYPE_CHECKING:
    from pandas import DataFrame


def models() -> "DataFrame":
    """Return the models by name: title, output, inputs and parameters.

    Examples
    --------
    >>> import mrfit
    >>> mrfit.models().loc["bingham", ["output", "parameters"]].to_dict()
    {'output': 'force', 'parameters': 'fy, C_inf, f0'}
    """
    from pandas import DataFrame

    specs = [registry.load("model", name).SPEC for name in registry.names("model")]
    rows = [
        {
            "name": spec.name,
            "title": spec.title,
            "output": spec.output,
            "inputs": ", ".join(spec.inputs),
            "parameters": ", ".join(p.name for p in spec.params),
        }
        for spec in specs
    ]
    return DataFrame(rows).set_index("name")
