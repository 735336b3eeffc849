"""FMU for co-simulation, FMI 2.0 or 3.0: model description, C sources, and binaries for the platforms at hand.

The inputs that hold at a step are those at its end. Parameters are tunable: a change acts from the next step on.
"""

import importlib.util
import io
import platform
import re
import uuid
import zipfile
from collections.abc import Mapping
from dataclasses import replace
from html import escape

from mrfit.core import children, temporary
from mrfit.errors import DataError
from mrfit.export.c import (
    TRACKER_ENDING,
    causality_told,
    compared,
    noise_told,
    notes_of,
    rendered,
    tracker_source,
    user_inputs,
)
from mrfit.export.c_parts import Parts, parts_of
from mrfit.export.causality import Cost, costs
from mrfit.export.compiler import compiled, required, run_compiler
from mrfit.export.fmi_description import build_description, model_description, start_of
from mrfit.export.head import head_lines
from mrfit.export.source import ExportSource
from mrfit.export.stage import Files
from mrfit.export.templating import TEMPLATES, environment
from mrfit.export.text import c_comment, number
from mrfit.export.tracker import TrackerPlan, plan_of
from mrfit.settings.export import Settings

HEADERS = TEMPLATES / "fmi" / "headers"
# Names of a platform in FMI 2 and 3, the ending of its libraries, and the name by which ziglang knows it
PLATFORMS = {
    ("Linux", "x86_64"): ("linux64", "x86_64-linux", "so", "x86_64-linux-gnu"),
    ("Linux", "aarch64"): ("aarch64-linux", "aarch64-linux", "so", "aarch64-linux-gnu"),
    ("Darwin", "x86_64"): ("darwin64", "x86_64-darwin", "dylib", "x86_64-macos"),
    ("Darwin", "arm64"): ("aarch64-darwin", "aarch64-darwin", "dylib", "aarch64-macos"),
    ("Windows", "AMD64"): ("win64", "x86_64-windows", "dll", "x86_64-windows-gnu"),
}
_FLAGS = ("-std=c99", "-O2", "-shared", "-fvisibility=hidden")
# A fixed time in archives: the same fit gives the same bytes
_EPOCH = (1980, 1, 1, 0, 0, 0)


def files(source: ExportSource, settings: Settings) -> Files:
    """Return an FMU of the model, and one of a tracker.

    Raises
    ------
    ConfigError
        If there is no C compiler.
    DataError
        If the model or an effect has no C form.
    """
    required("--to fmu")
    made = _written(source, settings)
    if settings.track:
        plan = plan_of(source, settings.track)
        own = _written(tracker_source(source), settings, plan)
        made = replace(made, contents={**made.contents, **own.contents})
    return made


def _written(source: ExportSource, settings: Settings, plan: TrackerPlan | None = None) -> Files:
    """Return one FMU, of the model or of a tracker."""
    parts = parts_of(source, tunable=not plan, plan=plan)
    prefix, token = parts.context.p, token_of(source, settings)
    cost = costs(source)
    sources = wrapped_sources(source, parts, cost, settings)
    told, error = "Difference from the simulation in Python: not measured (the fit's logs are not at hand).", None
    if plan:
        told = noise_told(source, plan)
    elif source.stretches:
        driver = environment(TEMPLATES / "fmi").get_template(f"driver{settings.fmi}.c.j2")
        text = driver.render(vars(parts.context), token=token)
        with compiled({**sources, "driver.c": text}, options=("-O2",)) as program:
            difference = compared(source, lambda drive, dt: program.run(user_inputs(source, drive), dt)[0])
        told, error = difference.text, difference.largest
    binaries = built_binaries(prefix, sources, settings.fmi)
    lines = [told, *notes_of(source), *causality_told(source, cost)]
    description = model_description(source, parts, token, head_lines(source, lines), settings.fmi, plan)
    archive = packed(prefix, description, sources, binaries, head_lines(source, lines), settings.fmi)
    said = (
        told,
        f"FMI {settings.fmi}.0 with binaries for {', '.join(sorted(p for p, _ in binaries))}",
        *notes_of(source),
    )
    return Files({f"{prefix}.fmu": archive}, said, error)


def token_of(source: ExportSource, settings: Settings) -> str:
    """Return the token that ties a description to its binary: of the fit, the parameters and the version."""
    text = f"{source.digest} {source.condition} {source.assembly.name} {settings.fmi}"
    if source.prefix.endswith(TRACKER_ENDING):
        text += f" {' '.join(settings.track)}"
    return f"{{{uuid.uuid5(uuid.NAMESPACE_URL, text)}}}"


def wrapped_sources(source: ExportSource, parts: Parts, cost: Cost, settings: Settings) -> dict[str, str]:
    """Return the C files of an FMU by name, the standard's headers included."""
    prefix = parts.context.p
    model = rendered(source, parts, [], cost)
    files = {name: model[name] for name in (f"{prefix}.h", f"{prefix}.c")}
    for path in sorted(HEADERS.glob(f"fmi{settings.fmi}*.h")):
        files[path.name] = path.read_text(encoding="utf-8").encode("ascii", "replace").decode("ascii")
    given = [(f"inputs.{c.field}", number(start_of(source, c.name))) for c in parts.context.inputs]
    given += [("measured", "0.0")] if parts.tracker else []
    outputs = [(f"outputs.{parts.context.output.field}", False), ("outputs.in_range", True)]
    if parts.tracker:
        size = range(len(parts.tracker.parameters))
        outputs += [("estimates.moving", True), *((f"estimates.value[{k}]", False) for k in size)]
        outputs += [(f"estimates.covariance[{k}][{j}]", False) for k in size for j in size if j >= k]
    places = list(enumerate([*((place, False) for place, _ in given), *outputs]))
    context = {
        **vars(parts.context),
        "tracker": parts.tracker,
        "given": given,
        "reals": [(k, place) for k, (place, flag) in places if not flag],
        "flags": [(k, place) for k, (place, flag) in places if flag],
        "clock": len(places) if parts.tracker else len(places) + parts.context.count,
        "head": c_comment([f"{source.assembly.name} as an FMU: see {prefix}.h and modelDescription.xml"]),
        "token": token_of(source, settings),
        "start": [number(v) for v in source.theta.tolist()],
    }
    template = environment(TEMPLATES / "fmi").get_template(f"fmi{settings.fmi}.c.j2")
    text = template.render(context, absent=())
    if settings.fmi == 3:
        text = template.render(context, absent=_absent(text, files["fmi3FunctionTypes.h"]))
    files[f"fmi{settings.fmi}.c"] = re.sub(r"\n{3,}", "\n\n", text).lstrip("\n")
    return files


def _absent(written: str, header: str) -> list[tuple[str, list[dict[str, str]]]]:
    """Return the functions of the standard that the template does not define, with their arguments."""
    plain = re.sub(r"/\*.*?\*/", "", header, flags=re.DOTALL)
    found = []
    for kind, name, listed in re.findall(r"typedef\s+([\w ]+?\*?)\s+(fmi3\w+)TYPE\s*\((.*?)\)\s*;", plain, re.DOTALL):
        if kind == "fmi3Status" and not re.search(rf"\b{name}\(", written):
            declared = [" ".join(a.split()) for a in listed.split(",")]
            names = [re.findall(r"(\w+)(?:\[\])?$", a)[0] for a in declared]
            found.append((name, [{"declared": a, "name": n} for a, n in zip(declared, names, strict=True)]))
    return found


def built_binaries(prefix: str, sources: Mapping[str, str], fmi: int) -> dict[tuple[str, str], bytes]:
    """Return the libraries by platform and ending: this machine's, others where ziglang is installed."""
    own = PLATFORMS.get((platform.system(), platform.machine()))
    if own is None:
        raise DataError(
            f"--to fmu: no name in FMI for {platform.system()} {platform.machine()}; export on another system"
        )
    found = {}
    with temporary.folder("fmu") as place:
        for name, text in sources.items():
            (place / name).write_text(text, encoding="ascii")
        code = [str(place / f"{prefix}.c"), str(place / f"fmi{fmi}.c")]
        # no paths of this machine in the library
        flags = [*_FLAGS, f"-ffile-prefix-map={place}=."]
        library = place / "own"
        run_compiler([*flags, "-fPIC", *code, "-lm", "-o", library], place, "--to fmu")
        found[own[0 if fmi == 2 else 1], own[2]] = library.read_bytes()
        if importlib.util.find_spec("ziglang") is not None:
            for two, three, ending, target in PLATFORMS.values():
                made = place / f"{target}.{ending}"
                command = [*children.python("ziglang"), "cc", "-target", target, *flags, *code, "-o", str(made)]
                done = children.run(command, place)
                if done.returncode == 0 and (two, three) != own[:2]:
                    found[two if fmi == 2 else three, ending] = made.read_bytes()
    return found


def packed(
    prefix: str,
    description: bytes,
    sources: Mapping[str, str],
    binaries: Mapping[tuple[str, str], bytes],
    head: list[str],
    fmi: int,
) -> bytes:
    """Return the archive."""
    page = f"<!DOCTYPE html><title>{prefix}</title><pre>{escape(chr(10).join(head))}</pre>\n"
    contents: dict[str, bytes] = {
        "modelDescription.xml": description,
        "documentation/index.html": page.encode("ascii", "xmlcharrefreplace"),
    }
    contents |= {f"sources/{name}": text.encode("ascii") for name, text in sorted(sources.items())}
    if fmi == 3:
        contents["sources/buildDescription.xml"] = build_description(prefix)
    contents |= {f"binaries/{p}/{prefix}.{ending}": data for (p, ending), data in sorted(binaries.items())}
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as made:
        for name, data in contents.items():
            entry = zipfile.ZipInfo(name, _EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
            made.writestr(entry, data)
    return archive.getvalue()
