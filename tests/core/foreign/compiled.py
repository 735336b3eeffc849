"""Models in C for tests: a Bingham body with a lag, as a plain function and as an FMU of FMI 2 or 3."""

import shutil
import subprocess
import zipfile
from pathlib import Path

import pytest

FUNCTION = """
#include <math.h>
#include <stdint.h>
/* F = fy*tanh(v/0.01) + c*z, z' = (v - z)/tau, backward Euler */
int lagged(const double *drive, const double *theta, double *output,
           int64_t channels, int64_t samples, int64_t parameters, double dt)
{
    double z = 0.0;
    if (channels != 1 || parameters != 3) return 1;
    for (int64_t n = 0; n < samples; n++) {
        if (n) z = (z + dt / theta[2] * drive[n]) / (1.0 + dt / theta[2]);
        output[n] = theta[0] * tanh(drive[n] / 0.01) + theta[1] * z;
    }
    return theta[0] > 9e3;
}
"""
PARAMETERS = """
[parameters.fy]
unit = "N"
low = 1.0
high = 1e4
start = 100.0
scale = "log"
role = "yield"
text = "yield force"
[parameters.c]
unit = "N*s/m"
low = 1.0
high = 1e5
start = 1000.0
text = "damping"
[parameters.tau]
unit = "s"
low = 1e-3
high = 0.1
start = 0.01
text = "lag"
"""
HEAD = 'name = "lagged"\ninputs = ["velocity"]\noutput = "force"\nlinear = ["fy", "c"]\n'

# What the two standards have in common: doubles by reference 0 v, 1 fy, 2 c, 3 tau, 4 F
_SLAVE = """
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#define E __attribute__((visibility("default")))
typedef struct { double x[5], z; } M;
static void out(M *m) { m->x[4] = m->x[1] * tanh(m->x[0] / 0.01) + m->x[2] * m->z; }
static int set(M *m, const unsigned *r, size_t n, const double *v)
{ for (size_t k = 0; k < n; k++) m->x[r[k]] = v[k]; return 0; }
static int get(M *m, const unsigned *r, size_t n, double *v)
{ out(m); for (size_t k = 0; k < n; k++) v[k] = m->x[r[k]]; return 0; }
static int step(M *m, double h)
{ m->z = (m->z + h / m->x[3] * m->x[0]) / (1.0 + h / m->x[3]); return m->x[1] > 9e3 ? 3 : 0; }
static int reset(M *m) { *m = (M){{0}, 0}; return 0; }
"""
_TWO = (
    _SLAVE
    + """
E const char *fmi2GetTypesPlatform(void) { return "default"; }
E const char *fmi2GetVersion(void) { return "2.0"; }
E void *fmi2Instantiate(const char *n, int t, const char *g, const char *r, const void *f, int v, int l)
{ return calloc(1, sizeof(M)); }
E void fmi2FreeInstance(void *m) { free(m); }
E int fmi2SetupExperiment(void *m, int d, double t, double s, int e, double z) { return 0; }
E int fmi2EnterInitializationMode(void *m) { return 0; }
E int fmi2ExitInitializationMode(void *m) { return 0; }
E int fmi2Terminate(void *m) { return 0; }
E int fmi2Reset(void *m) { return reset(m); }
E int fmi2GetReal(void *m, const unsigned *r, size_t n, double *v) { return get(m, r, n, v); }
E int fmi2SetReal(void *m, const unsigned *r, size_t n, const double *v) { return set(m, r, n, v); }
E int fmi2DoStep(void *m, double t, double h, int p) { return step(m, h); }
"""
)
_THREE = (
    _SLAVE
    + """
E const char *fmi3GetVersion(void) { return "3.0"; }
E void *fmi3InstantiateCoSimulation(const char *n, const char *t, const char *p, _Bool v, _Bool l, _Bool e, _Bool r,
    const unsigned *q, size_t k, void *i, void *g, void *u) { return calloc(1, sizeof(M)); }
E void fmi3FreeInstance(void *m) { free(m); }
E int fmi3EnterInitializationMode(void *m, _Bool d, double t, double s, _Bool e, double z) { return 0; }
E int fmi3ExitInitializationMode(void *m) { return 0; }
E int fmi3EnterStepMode(void *m) { return 0; }
E int fmi3Terminate(void *m) { return 0; }
E int fmi3Reset(void *m) { return reset(m); }
E int fmi3GetFloat64(void *m, const unsigned *r, size_t n, double *v, size_t k) { return get(m, r, n, v); }
E int fmi3SetFloat64(void *m, const unsigned *r, size_t n, const double *v, size_t k) { return set(m, r, n, v); }
E int fmi3DoStep(void *m, double t, double h, _Bool p, _Bool *e, _Bool *d, _Bool *r, double *l)
{ *e = *d = *r = 0; *l = t + h; return step(m, h); }
"""
)
_NAMES = ("speed", "fy", "c", "tau", "F")


def compiled(source: str, path: Path) -> Path:
    """Compile C text into a shared library."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if not compiler:
        pytest.skip("not run: there is no C compiler")
    text = path.with_suffix(".c")
    text.write_text(source)
    path.parent.mkdir(parents=True, exist_ok=True)
    subprocess.run([compiler, "-O2", "-shared", "-fPIC", "-o", path, text, "-lm"], check=True, capture_output=True)
    return path


def fmu(path: Path, three: bool = False) -> Path:
    """Write an FMU for co-simulation whose channel names are others than mrfit's."""
    folder = path.parent / "unpacked"
    folder.mkdir(exist_ok=True)
    source = _THREE if three else _TWO
    library = compiled(source + _others(source, three), folder / "lagged.so")
    (folder / "modelDescription.xml").write_text(_description(three))
    with zipfile.ZipFile(path, "w") as made:
        made.write(folder / "modelDescription.xml", "modelDescription.xml")
        made.write(library, f"binaries/{'x86_64-linux' if three else 'linux64'}/lagged.so")
    return path


def _others(source: str, three: bool) -> str:
    """Return the rest of the standard's functions, all of which an FMU has: these answer with an error."""
    from fmpy.fmi2 import FMU2Slave
    from fmpy.fmi3 import FMU3Slave

    every = [n for n in dir(FMU3Slave if three else FMU2Slave) if n.startswith("fmi3" if three else "fmi2")]
    return "".join(f"E int {n}(void) {{ return 3; }}\n" for n in every if f"{n}(" not in source)


def _description(three: bool) -> str:
    kinds = [("input", "continuous"), *3 * [("parameter", "tunable")], ("output", "continuous")]
    rows = []
    for k, (name, (causality, variability)) in enumerate(zip(_NAMES, kinds, strict=True)):
        start = "" if causality == "output" else ' start="0"'
        about = f'name="{name}" valueReference="{k}" causality="{causality}" variability="{variability}"'
        rows.append(
            f"<Float64 {about}{start}/>" if three else f"<ScalarVariable {about}><Real{start}/></ScalarVariable>"
        )
    variables, unknown = (
        "".join(rows),
        '<Output valueReference="4"/>' if three else '<Outputs><Unknown index="5"/></Outputs>',
    )
    key, version = ("instantiationToken", "3.0") if three else ("guid", "2.0")
    return (
        '<?xml version="1.0" encoding="UTF-8"?>'
        f'<fmiModelDescription fmiVersion="{version}" modelName="lagged" {key}="1">'
        f'<CoSimulation modelIdentifier="lagged"/><ModelVariables>{variables}</ModelVariables>'
        f"<ModelStructure>{unknown}</ModelStructure></fmiModelDescription>"
    )
