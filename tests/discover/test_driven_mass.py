"""Discovery on logs of a driven mass: the excitation less inertia is the law's force, and another law is nearer."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from benchmarks.driven import DT, LAWS, SAMPLES, excitation
from mrfit.discover.stage import Settings
from mrfit.discover.writing.driven_mass import of_driven, with_inertia
from mrfit.discover.writing.result import DiscoveryRequest, insufficient, model_toml
from mrfit.io.schemas.discovery import OtherLaw
from mrfit.report.explain import next_step
from mrfit.simulate.assembly import assemble
from tests import commands

SOFTENING = {**LAWS["boucwen-hardening"], "b": 0.7, "mass": 2.0}
HYSTERETIC = {"boucwen", "boucwen-hardening", "spencer"}


@pytest.mark.parametrize(("mass", "law"), [("free", "bingham+inertia"), ("2.0", "bingham")])
def test_a_free_mass_is_fitted_with_every_law_and_told_as_the_mass(mass: str, law: str) -> None:
    asked = Settings("bingham", driven_by="force", mass=mass)
    assert with_inertia(asked).model == law
    found = insufficient(DiscoveryRequest(law, 0, "", ""), "too few")
    nearer = OtherLaw(
        model=law.replace("bingham", "dahl"), holdout_nrmse=0.1, takes=0.9,
        command=f"mrfit discover --model {law.replace('bingham', 'dahl')}",
    )  # fmt: skip
    found = found.model_copy(update={"other_laws": (nearer,), "augmented_model": f"{law}+delay", "verdict": "named"})
    told = of_driven(found, asked).model_copy(update={"settings": {"driven_by": "force", "mass": mass}})
    assert (told.base_model, told.augmented_model, told.other_laws[0].model) == ("bingham", "bingham+delay", "dahl")
    assert told.other_laws[0].command == f"mrfit discover --model dahl --driven-by force --mass {mass}"
    assert next_step(told) == f"mrfit fit --model bingham+delay --driven-by force --mass {mass} --per all"
    (fit,) = tomllib.loads(model_toml(told))["fit"]
    assert fit == {"model": "bingham+delay", "per": "all", "driven_by": "force", "mass": mass}
    assert of_driven(found, Settings("bingham")) is found


@pytest.mark.slow
@pytest.mark.parametrize("base", ["linear-spring-dashpot", "bingham"])
def test_from_a_base_without_hysteresis_a_hysteretic_law_is_nearer(tmp_path: Path, base: str) -> None:
    rng, whole = np.random.default_rng(41), assemble("boucwen-hardening@force")
    for number, rms in enumerate((30.0, 60.0, 90.0, 120.0, 75.0)):
        drive = excitation(rng, rms)
        moved = whole.simulate(drive[None], whole.spec.theta(SOFTENING)[None], DT)[0]
        rows = [np.arange(SAMPLES) * DT, drive, moved + 1e-3 * np.std(moved) * rng.standard_normal(SAMPLES)]
        header = "time_s,excitation_force_N,displacement_m"
        np.savetxt(tmp_path / f"{number}.csv", np.column_stack(rows), "%.17g", ",", header=header, comments="")
    assert commands.run(tmp_path, "ingest", *(f"{n}.csv" for n in range(5))).returncode == 0
    line = f"discover --model {base} --driven-by force --mass free --json"
    done = commands.text(tmp_path, *line.split(), timeout=900.0)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    nearest = found["other_laws"][0]
    assert nearest["model"] in HYSTERETIC
    assert nearest["holdout_nrmse"] < 0.7 * found["gap"]["before"]
    assert nearest["holdout_nrmse"] <= found["gap"]["after"]
    assert nearest["floors"] < 1.5
    assert (tmp_path / found["page"]).is_file()
