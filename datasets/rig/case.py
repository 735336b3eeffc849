"""One hidden-effect case: a folder of logs as a lab would hand them over, and beside it, not in it, the truth."""

import json
from dataclasses import asdict, dataclass, field
from math import inf
from pathlib import Path

import numpy as np

from datasets.rig import coil_bench, damper_bench, press
from datasets.rig.coil import other_coil
from datasets.rig.damper import base_damper, plain_damper
from datasets.rig.effects import EFFECTS
from datasets.rig.flux_coil import base_coil
from datasets.rig.refit import coil_gap, damper_gap, nrmse, rebuilt_flux
from datasets.rig.style import Style


@dataclass(frozen=True, slots=True)
class Hidden:
    """What is built into one set of logs.

    Attributes
    ----------
    bench
        ``coil``; ``other-coil``, which saturates and is made of stops, so that no Bouc-Wen law fits it; ``damper``;
        ``plain-damper``, which has neither spring nor hysteresis.
    programme
        Which tests are run, a key of the bench's ``PROGRAMMES``.
    effects
        Canonical name -> magnitude in SI, see ``effects.py``.
    seed
        Chooses the base law's parameters, the tests' random parts and the noise.
    style
        How the logs are written down.
    """

    bench: str
    programme: str = "rich"
    effects: dict[str, float] = field(default_factory=dict)
    seed: int = 0
    style: Style = Style()


def make(hidden: Hidden, folder: Path) -> dict[str, object]:
    """Write ``folder/logs`` and ``folder/truth.json``; return the truth.

    The truth holds the effects, how much of the range they move the output (``share``), how much of that the base law
    cannot absorb (``visible``) and the noise, all as NRMSE.
    """
    logs = folder / "logs"
    logs.mkdir(parents=True)
    unknown = set(hidden.effects) - set(EFFECTS)
    if unknown:
        raise ValueError(f"no such effect on the bench: {', '.join(sorted(unknown))}; see datasets/rig/effects.py")
    measured = _coil(hidden, logs) if hidden.bench.endswith("coil") else _damper(hidden, logs)
    text = json.dumps(asdict(hidden) | measured, indent=1)
    (folder / "truth.json").write_text(text + "\n", encoding="utf-8")
    truth: dict[str, object] = json.loads(text)
    return truth


def _plain(values: dict[str, object]) -> dict[str, object]:
    """Return values as JSON can hold them."""
    return {
        k: _plain(v) if isinstance(v, dict) else v.tolist() if isinstance(v, np.ndarray) else v
        for k, v in values.items()
        if not isinstance(v, float) or v < inf
    }


def _coil(hidden: Hidden, logs: Path) -> dict[str, object]:
    rng = np.random.default_rng([hidden.seed, 1])
    flux_coil = base_coil(rng)
    coil = flux_coil if hidden.bench == "coil" else other_coil(rng)
    record = coil_bench.run(coil, hidden.effects, coil_bench.PROGRAMMES[hidden.programme]())
    written = coil.resistance * (1.0 + hidden.effects.get("resistance-error", 0.0))
    noise = coil_bench.save(record, logs, hidden.style, np.random.default_rng([hidden.seed, 2]))
    (logs / "mrfit.toml").write_text(coil_bench.channel_map(written, hidden.style), encoding="utf-8")
    share, visible = coil_gap(record, flux_coil.iron, written, hidden.style.integrator)
    clean = rebuilt_flux(record.voltage, record.current, record.interval, written)
    if hidden.style.integrator:
        floor = coil_bench.INTEGRATOR_NOISE / coil_bench.INTEGRATOR / float(np.ptp(clean))
    else:
        noisy = rebuilt_flux(record.voltage + noise[0], record.current + noise[1], record.interval, written)
        floor = nrmse(noisy - clean, clean)
    return {"base": _plain(asdict(coil)), "map_resistance": written, "share": share, "visible": visible, "noise": floor}


def _damper(hidden: Hidden, logs: Path) -> dict[str, object]:
    draw = base_damper if hidden.bench == "damper" else plain_damper
    damper = draw(np.random.default_rng([hidden.seed, 1]))
    tests = press.PROGRAMMES[hidden.programme](np.random.default_rng([hidden.seed, 3]))
    record = damper_bench.run(damper, hidden.effects, tests)
    noise = damper_bench.save(record, logs, hidden.style, np.random.default_rng([hidden.seed, 2]))
    share, visible = damper_gap(record, damper)
    return {"base": asdict(damper), "share": share, "visible": visible, "noise": nrmse(noise, record.force)}
