"""Public records of real dampers: the best model, and what its authors reached."""

import os
from pathlib import Path

import numpy as np
from scipy.io import loadmat

import mrfit
from benchmarks.command import run_mrfit
from benchmarks.studies.page import AT_MOST, Row, Rule, Study, Table, compare
from benchmarks.studies.runs import ROOT, errors, fit_file
from mrfit.simulate.assembly import assemble

TABLE_LOGS = (".A.1", ".A.5", ".A.9", ".B.1", ".B.5", ".B.9", "2.2.2", "5.2.2", "8.2.2", "3.1", "5.1", "9.1")
SETS = {
    "press": ("mr_damper_utfsm/preprocessed",),
    "keio": ("mr_damper_sano_keio/Magneto.mat",),
    "table": tuple(f"mr_damper_labcontrol/ensaio{n}.mat" for n in TABLE_LOGS),
    "prototype": ("mr_damper_nees_dyke/ranran_50_converted.csv",),
}
# By `make studies`; the prototype's fits take minutes
HERE = ("press", "keio", "table")
# What others report of these records: a simple Bouc-Wen model of the Keio record, in % fit on its second part, and the
# errors in % that the sheet of the shaking table's authors gives of their Dahl models
KEIO_BOUC_WEN = 84.6
TABLE_DAHL = (21.25, 36.66)
AT_LEAST = Rule("one-sided: at least what is reported", lambda paper, own: (own[0] or 0.0) >= (paper[0] or 0.0))
WORST = Rule("one-sided: no condition is worse than the worst", lambda paper, own: AT_MOST.holds(paper[1:], own[1:]))


def log_words(root: Path, name: str) -> list[str]:
    """Return the words of a command that name the logs of a set."""
    return [word for f in SETS[name] for word in ("--log", str(root / f))]


def author_error(root: Path, names: tuple[str, ...]) -> float:
    """Return the NRMSE on logs together of the press's authors' own model: Spencer's, in N, mm, s, over current."""
    p = loadmat(root / "mr_damper_utfsm" / "ajuste2_parametros.mat", squeeze_me=True)["parametros"]
    whole, measured, off = assemble("spencer"), [], []
    for log in mrfit.read(str(root / SETS["press"][0]), map=ROOT / "pipelines" / "maps" / "press.toml"):
        if Path(log.source).stem not in names:
            continue
        frame, i = log.to_frame(), log.condition["current"]
        shape = 1e3 * p[6] * np.exp(p[7] * i)
        values = {
            **{"K_inf": 1e3 * p[0], "K0": 1e3 * p[1], "f0": -p[1] * p[2]},
            **{"alpha": p[3] * i**2 + p[4] * i + p[5], "A": 300e3, "n": 2.0, "beta": shape, "gamma": shape},
            **{"C_inf": 1e3 * (p[8] * i + p[9]), "C0": 1e3 * (p[10] * i + p[11])},
        }
        drive = np.stack([frame[n].to_numpy() for n in whole.spec.inputs])
        force = whole.simulate(drive, np.array([[values[n] for n in whole.spec.names]]), log.dt)[0]
        measured.append(frame["force"].to_numpy())
        off.append(measured[-1] - force)
    return float(np.sqrt(np.mean(np.concatenate(off) ** 2)) / np.ptp(np.concatenate(measured)))


def press_table(work: Path, root: Path) -> Table:
    """Return errors on the two tests held out, of mrfit's fits and of the authors' model, fitted to all tests."""
    authors = 100.0 * author_error(root, ("5mm3Hz0A", "5mm3Hz0x5A"))
    rows = []
    for model in ("spencer", "hysteretic-biviscous", "bingham"):
        error = 100.0 * errors(fit_file(work / "press", f"{model}.auto.all"), "nrmse", "holdout")["all"]
        known = model == "spencer"
        rows.append(compare(model, [authors], [error], AT_MOST, "ordering") if known else Row(model, [None], [error]))
    note = (
        "NRMSE in % on 5 mm, 3 Hz at 0 and 0.5 A together. Published: the authors' own twelve parameters of Spencer's "
        "model, fitted to all tests, simulated here. mrfit has not seen these two."
    )
    return Table("Press (UTFSM): errors on tests held out", "parameters of the authors", "model", [""], rows, note)


def keio_table(work: Path) -> Table:
    """Return the fit in % on the second part of the Keio record."""
    rows = []
    for model in ("lugre+delay", "bingham"):
        held = errors(fit_file(work / "keio", f"{model}.auto.all"), "fit_percent", "holdout")["all"]
        known = model != "bingham"
        rows.append(
            compare(model, [KEIO_BOUC_WEN], [held], AT_LEAST, "ordering") if known else Row(model, [None], [held])
        )
    note = (
        "Fit in % in free run on the second record. Published: a simple Bouc-Wen model, as the tests here cite "
        "it; its source was not seen again."
    )
    return Table("Keio: fit on the record held out", "as reported", "model", [""], rows, note)


def shaking_table(work: Path) -> Table:
    """Return the errors in each condition of the shaking table."""
    rows = []
    for model in ("dahl", "boucwen", "spencer"):
        found = errors(fit_file(work / "table", f"{model}.auto"), "relative_rmse")
        each = [100.0 * v for c, v in found.items() if c != "all"]
        own: list[float | None] = [min(each), max(each)]
        known = model == "dahl"
        rows.append(compare(model, [*TABLE_DAHL], own, WORST, "ordering") if known else Row(model, [None, None], own))
    note = (
        "Least and greatest error of a condition in %, rms over rms force. Published: four errors in the authors' "
        "sheet, which does not define them."
    )
    return Table("Shaking table (labcontrol)", "sheet of the authors", "model", ["least", "greatest"], rows, note)


def run(logs: Path, work: Path) -> Study | None:
    """Run the study, or return None where the real logs are absent."""
    root = Path(os.environ.get("MRFIT_REAL_LOGS", ""))
    if not os.environ.get("MRFIT_REAL_LOGS") or not root.is_dir():
        return None
    for name in HERE:
        run_mrfit(work / name, "run", str(ROOT / "pipelines" / f"study-{name}.toml"), *log_words(root, name))
    return Study(
        "real",
        "Public records of real dampers",
        "UTFSM press, Keio, labcontrol shaking table (`datasets/catalog.toml` and its sources)",
        "Real logs, not shipped; this study is skipped where `MRFIT_REAL_LOGS` names no folder of them.",
        [f"mrfit run pipelines/study-{name}.toml --log …" for name in HERE],
        [press_table(work, root), keio_table(work), shaking_table(work)],
        [],
        [
            "The prototype damper (NEES-2012-1158), and discovery on all these records: by `make studies-long`.",
        ],
    )
