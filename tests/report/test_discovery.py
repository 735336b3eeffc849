"""The discovery's page and words, on a small discovery whose every number is known in closed form."""

import json
import re
from dataclasses import asdict, replace

import numpy as np
import pytest

from mrfit.core.recording import Recording, Segment
from mrfit.errors import DataError
from mrfit.io.schemas.discovery import DiscoveryDependence, DiscoveryFile, FoundEffect
from mrfit.io.tables import read_table, write_table
from mrfit.io.workspace import Workspace, write_json
from mrfit.report import discovery, discovery_figures
from mrfit.report.discovery_source import read_discovery
from mrfit.report.explain import closed_share, headline, next_step, parameter_rows, sentences
from tests.report.test_page import Page, plain

RATE, CYCLES, NOISE = 200, 5, 2e-5
AMPLITUDES = {"sine-1Hz-1A": 1.0, "sine-5Hz-3A": 3.0, "sine-10Hz-5A": 5.0}
HELD_OUT = "sine-5Hz-3A"
SPAN = 0.02 * 2 * 5.0
EFFECT = {
    "name": "eddy-current",
    "parameters": [{"name": "tau", "unit": "s", "value": 0.0021, "low": 0.00205, "high": 0.00215}],
    "aliases": [],
    "holdout_nrmse_before": 0.031,
    "holdout_nrmse_after": 0.0101,
}
FOUND = {
    "schema": "mrfit/discovery/1",
    "base_model": "boucwen-flux",
    "verdict": "named",
    "effects": [EFFECT],
    "ambiguous_set": [],
    "advice": [],
    "where": [
        {"region": "frequency 10 Hz <peak>", "share_of_error": 0.62, "share_of_samples": 0.33},
        {"region": "near reversal of the current", "share_of_error": 0.3, "share_of_samples": 0.2},
    ],
    "where_text": ["frequency 10 Hz <peak>: 62 % of the squared error in 33 % of the samples"],
    "gap": {"noise_floor": 0.01, "before": 0.031, "after": 0.0101, "closed": 0.9976},
    "candidates": [
        {
            "name": "eddy-current",
            "screen": 0.41,
            "strength": 9.0,
            "holdout_gain": 0.89,
            "accepted": True,
            "reason": "a",
        },
        {"name": "probe-skew", "screen": 0.4, "strength": 9.0, "holdout_gain": 0.0, "accepted": False, "reason": "b<c"},
        {"name": "saturation", "screen": 0.0, "strength": 1.0, "holdout_gain": None, "accepted": False, "reason": "d"},
        {
            "name": "integrator-offset",
            "screen": 0.0,
            "strength": 0.0,
            "holdout_gain": None,
            "accepted": False,
            "reason": "cannot be judged: no integrator",
        },
    ],
    "confusable": [{"pair": ["eddy-current", "probe-skew"], "cosine": 0.9973}],
    "cosines": {
        "names": ["eddy-current", "probe-skew", "saturation"],
        "matrix": [[1.0, 0.9973, -0.21], [0.9973, 1.0, 0.04], [-0.21, 0.04, 1.0]],
        "alike": 0.8,
    },
    "unexplained": {"share_of_gap": 0.0024, "predictable": 0.0, "where": [], "text": []},
    "augmented_model": "boucwen-flux+eddy-current",
    "segments": [
        {
            "id": f"{c}#0",
            "condition": c,
            "role": "holdout" if c == HELD_OUT else "train",
            "noise_floor": NOISE / SPAN,
        }
        for c in AMPLITUDES
    ],
    "seed": 4,
    "data_sha256": "0123456789abcdef" * 4,
    "current_dependence": None,
    "key": "k",
}
AMBIGUOUS = FOUND | {
    "verdict": "ambiguous",
    "effects": [],
    "ambiguous_set": ["eddy-current", "probe-skew"],
    "suspects": [
        {"name": "eddy-current", "parameters": EFFECT["parameters"], "holdout_nrmse_after": 0.0101},
        {"name": "probe-skew", "parameters": EFFECT["parameters"], "holdout_nrmse_after": 0.0102},
    ],
    "advice": ["eddy-current: sines over a decade", "probe-skew: swap the probes"],
}
UNEXPLAINED = FOUND | {"verdict": "unexplained", "effects": [], "augmented_model": "boucwen-flux"}
NONE = UNEXPLAINED | {
    "verdict": "none",
    "gap": {"noise_floor": 0.01, "before": 0.0101, "after": 0.0101, "closed": None},
    "where_text": [],
}
INSUFFICIENT = NONE | {
    "verdict": "insufficient-data",
    "advice": ["no held-out condition: there is 1, and a verdict needs at least four"],
    "where": [],
    "candidates": [],
    "confusable": [],
    "gap": dict.fromkeys(("noise_floor", "before", "after", "closed")),
    "unexplained": {"share_of_gap": None, "where": []},
    "segments": [],
}


def typed(found: dict) -> DiscoveryFile:
    return DiscoveryFile.of(found)


def errors(amplitude: float) -> tuple[np.ndarray, np.ndarray]:
    """Return errors before and after: RMS 1e-3·A and 1e-4·A."""
    phase = 2 * np.pi * np.arange(CYCLES * RATE) / RATE
    return np.sqrt(2) * 1e-3 * amplitude * np.cos(phase), np.sqrt(2) * 1e-4 * amplitude * np.cos(3 * phase)


def study(root, found: dict) -> Workspace:
    workspace, rng = Workspace(root), np.random.default_rng(3)
    segments, rows = [], []
    for number, (condition, amplitude) in enumerate(AMPLITUDES.items()):
        frequency = float(condition.split("-")[1].removesuffix("Hz"))
        phase = 2 * np.pi * np.arange(CYCLES * RATE) / RATE
        current = amplitude * np.sin(phase)
        flux = 0.02 * current + NOISE * rng.standard_normal(len(phase))
        dt = 1.0 / (frequency * RATE)
        channels, units = {"current": current, "flux": flux}, {"current": "A", "flux": "Wb"}
        workspace.write_recording(
            Recording(condition, f"{condition}.csv", "0" * 64, "delimited", dt, 0, channels, units)
        )
        role = "holdout" if condition == HELD_OUT else "train"
        place = (0, len(phase), 0, "sine", "current", frequency, amplitude, 0.0, CYCLES, np.nan, np.nan, role)
        segments.append(Segment(f"{condition}#0", condition, condition, *place))
        before, after = errors(amplitude)
        rows.append(
            {
                "segment": np.full(len(phase), float(number)),
                "holdout": np.full(len(phase), float(role == "holdout")),
                "time": dt * np.arange(len(phase)),
                "measured": flux,
                "before": before,
                "after": after,
            }
        )
    workspace.write_segments(segments, {})
    folder = root / "discover"
    write_json(folder / "discovery.json", found)
    if found["candidates"]:
        write_table(folder / "residuals.parquet", {k: np.concatenate([r[k] for r in rows]) for k in rows[0]})
    return workspace


@pytest.fixture(scope="module")
def named(tmp_path_factory):
    workspace = study(tmp_path_factory.mktemp("named"), FOUND)
    assert not discovery.run(workspace).skipped
    return workspace


@pytest.fixture(scope="module")
def text(named) -> str:
    return (named.root / "discover" / "discovery.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def page(text) -> Page:
    return Page(text)


def test_page_is_balanced_and_asks_for_nothing_from_outside(page, text):
    assert not page.open and not page.unbalanced
    links = [v for _, name, v in page.attributes if name in ("href", "src", "xlink:href", "srcset", "action")]
    assert links and all(v.startswith(("#", "data:image/png;base64,")) for v in links)
    assert not re.search(r"https?:|@import|url\((?!#)", text)


def test_links_lead_somewhere_and_ids_are_unique(page):
    ids = [v for _, name, v in page.attributes if name == "id"]
    assert len(ids) == len(set(ids))
    targets = {v[1:] for _, name, v in page.attributes if name in ("href", "xlink:href") and v.startswith("#")}
    assert targets <= set(ids)


def test_tables_have_captions_and_figures_are_described(page):
    assert set(page.tables) == {"effects", "candidates", "confusion", "run", "used"}
    # a folded table is unfolded by its caption
    assert set(page.captions) == {*page.tables} - {"used"}
    drawings = [v for tag, name, v in page.attributes if tag == "svg" and name == "aria-label"]
    assert len(drawings) == 5 and all(len(v) > 20 for v in drawings)


def test_verdict_effect_and_errors_stand_on_the_page(text):
    for said in (
        "boucwen-flux lacks eddy currents in the core (eddy-current).",
        "falls from 3.10 % to 1.01 % of the range; the noise floor is 1.00 %: 99.76 % of the gap is closed",
        "mrfit fit --model boucwen-flux+eddy-current --per all",
        "SHA-256 0123456789abcdef",
        "3 segments, 3000 samples; 1 held-out condition",
    ):
        assert said in text, said


def test_candidates_show_the_numbers_of_discovery_json(page):
    rows = page.tables["candidates"][1:]
    assert [r[0]["text"] for r in rows] == [c["name"] for c in FOUND["candidates"]]
    for cells, candidate in zip(rows, FOUND["candidates"], strict=True):
        gain = candidate["holdout_gain"]
        if candidate["reason"].startswith("cannot be judged"):
            assert (cells[2]["exact"], cells[3]["text"].splitlines()[0]) == ([], "not judged")
        else:
            # one number: the gain where it was refitted, else what screening says
            share, word = (candidate["screen"], "screened") if gain is None else (gain, "refitted")
            assert cells[2]["exact"] == [repr(share)] and cells[3]["text"].startswith(word)
            assert plain(cells[2]["shown"][0]) == pytest.approx(100 * share, rel=6e-3)
        assert (cells[4]["text"], cells[5]["text"].splitlines()[0]) == (
            "yes" if candidate["accepted"] else "no",
            candidate["reason"],
        )


def test_matrix_holds_every_cosine_and_marks_the_pairs_that_are_alike(page, text):
    head, first, second, third = page.tables["confusion"]
    assert [c["text"].splitlines()[0] for c in head] == ["effect", "eddy-current", "probe-skew", "saturation"]
    assert [c["text"].splitlines()[0] for c in first[:2]] == ["eddy-current", "1"] and len(first) == 4
    assert [c["text"].splitlines()[0] for c in second[:3]] == ["probe-skew", "0.997", "1"]
    assert [plain(c["text"].splitlines()[0]) for c in third[1:]] == [-0.21, 0.04, 1.0]
    assert "<mark>0.997</mark>" in text and text.count("<mark>") == 1
    assert "Told apart from every other: saturation." in text
    assert "<strong>integrator-offset</strong>: cannot be judged: no integrator" in text


@pytest.mark.parametrize(("limit", "marked", "alone"), [(0.8, 1, []), (0.9, 0, ["delay", "inertia"])])
def test_pairs_are_marked_from_the_cosine_on_that_the_discovery_took_for_alike(limit, marked, alone):
    table = {"names": ["delay", "inertia"], "matrix": [[1.0, -0.85], [-0.85, 1.0]], "alike": limit}
    found = typed(FOUND | {"cosines": table})
    (section,) = discovery._confusion(found.cosines, found.candidates)
    cells = [cell for row in section.tables[0].rows for cell in row]
    assert sum("<mark>" in str(cell) for cell in cells) == marked
    assert f"Pairs above {limit:g}" in section.words[0]
    assert section.words[1:] == [f"Told apart from every other: {', '.join(alone)}."] * bool(alone)


def test_text_from_the_discovery_is_not_taken_for_markup(text):
    assert "b&lt;c" in text and "frequency 10 Hz &lt;peak&gt;" in text and "<peak>" not in text


def test_page_is_made_again_only_if_what_it_shows_has_changed(tmp_path):
    workspace = study(tmp_path, FOUND)
    assert [discovery.run(workspace).skipped for _ in range(2)] == [False, True]
    first = (tmp_path / "discover" / "discovery.html").read_bytes()
    write_json(tmp_path / "discover" / "discovery.json", FOUND | {"seed": 5})
    assert not discovery.run(workspace).skipped
    write_json(tmp_path / "discover" / "discovery.json", FOUND)
    assert not discovery.run(workspace).skipped
    assert (tmp_path / "discover" / "discovery.html").read_bytes() == first


@pytest.fixture(scope="module")
def drawn(named):
    canvases, patch = {}, pytest.MonkeyPatch()
    patch.setattr(discovery_figures, "to_svg", lambda canvas, title: canvases.setdefault(title, canvas) and "<svg/>")
    figures = discovery_figures.figures_of(read_discovery(named))
    patch.undo()
    assert [f.name for f in figures] == ["where", "map", "error", "residual", "loop-current"]
    return canvases


def test_regions_are_drawn_as_their_shares(drawn):
    axes = drawn["Where the base model errs"].axes[0]
    widths = [[bar.get_width() for bar in group] for group in axes.containers]
    assert np.allclose(widths, [[62.0, 30.0], [33.0, 20.0]])


def test_residual_map_has_one_scale(drawn):
    before, after = (axes.images[0] for axes in drawn["Residual map"].axes[:2])
    assert before.get_clim() == after.get_clim()
    ratio = np.nanmax(before.get_array().filled(np.nan)) / np.nanmax(after.get_array().filled(np.nan))
    # ten times, but for cells in which conditions of other amplitudes lie as well
    assert 5.0 < ratio < 15.0


def test_map_cells_hold_the_rms_of_the_residuals_in_them():
    drive = np.array([0.0, 0.0, 1.0, 1.0])
    values = discovery_figures._rms_map(drive, drive, np.array([3.0, 4.0, -2.0, 2.0]))
    assert values[0, 0] == pytest.approx(np.sqrt(12.5)) and values[-1, -1] == pytest.approx(2.0)
    assert np.isnan(values[0, -1]) and np.isfinite(values).sum() == 2


def test_errors_are_drawn_as_shares_of_the_range_over_all_conditions(drawn):
    axes = drawn["NRMSE"].axes[0]
    before, after, floor = (line.get_xdata() for line in axes.lines)
    order = ["sine-5Hz-3A", "sine-1Hz-1A", "sine-10Hz-5A"]
    assert [t.get_text().split(" ")[0] for t in axes.get_yticklabels()] == order
    expected = np.array([AMPLITUDES[c] for c in order])
    assert np.allclose(before, 100 * 1e-3 * expected / SPAN, rtol=2e-3)
    assert np.allclose(after, 100 * 1e-4 * expected / SPAN, rtol=2e-3)
    assert np.allclose(floor, 100 * NOISE / SPAN, rtol=0.1)


def test_residuals_share_one_scale_and_loops_show_measured_before_and_after(drawn):
    canvas = drawn["Residual before and after"]
    assert len({axes.get_ylim() for axes in canvas.axes}) == 1
    loop = drawn["Flux–current loop before and after"].axes[0]
    assert [line.get_label() for line in loop.lines] == ["measured", "before", "after"]
    assert np.ptp(loop.lines[0].get_xdata()) == pytest.approx(6.0, rel=1e-3)


@pytest.mark.parametrize(
    ("found", "words", "also"),
    [
        (AMBIGUOUS, "cannot tell whether it is eddy-current or probe-skew", "swap the probes"),
        (UNEXPLAINED, "no effect of the library explains it", "62 % of the squared error"),
        (
            NONE,
            "Nothing that rises above the noise of these data is missing from boucwen-flux",
            "1.01 times the noise floor",
        ),
        (INSUFFICIENT, "These data are too few", "No held-out condition: there is 1"),
    ],
    ids=lambda v: v["verdict"] if isinstance(v, dict) else "",
)
def test_every_verdict_has_its_page(tmp_path, found, words, also):
    path = discovery.run(study(tmp_path, found)).path
    with open(path, encoding="utf-8") as handle:
        text = handle.read()
    parsed = Page(text)
    assert not parsed.open and not parsed.unbalanced
    assert words in headline(typed(found)) and words in text and also in text
    assert "mrfit fit" not in text


def test_what_would_take_part_of_the_gap_is_said_with_what_could_stand_instead():
    partly = {"parameters": EFFECT["parameters"], "holdout_nrmse_after": 0.03, "closed": 0.62}
    suspects = [{"name": "eddy-current", **partly}, {"name": "probe-skew", "instead_of": "eddy-current", **partly}]
    said = " ".join(sentences(typed(UNEXPLAINED | {"suspects": suspects})))
    assert headline(typed(UNEXPLAINED | {"suspects": suspects})).endswith("explains all of it.")
    assert "(eddy-current) with" in said and "would take 62.0 % of the gap" in said
    assert "(probe-skew) with" in said.partition("(or ")[2] and "cannot tell from it)" in said


@pytest.mark.parametrize(
    ("bounds", "said"),
    [
        (
            {HELD_OUT: (0.003, 0.006), "sine-1Hz-1A": (0.001, 0.5)},
            "the noise floor lies between about 0.300 % and 0.600 %.",
        ),
        ({HELD_OUT: (0.003, None), "sine-1Hz-1A": (0.001, 0.5)}, "the noise floor is not known."),
        ({}, "the noise floor is not known."),
    ],
)
def test_a_noise_floor_that_was_not_measured_has_the_bounds_of_held_out_conditions(bounds, said):
    segments = [
        {**one, "noise_floor": None, "noise_floor_bounds": bounds.get(one["condition"], (None, None))}
        for one in FOUND["segments"]
    ]
    gap = {"noise_floor": None, "before": 0.031, "after": 0.0101, "closed": None}
    assert said in " ".join(sentences(typed(FOUND | {"gap": gap, "segments": segments})))


def test_what_stays_unexplained_is_said_only_above_the_noise():
    gap = {"noise_floor": 0.01, "before": 0.05, "after": 0.02, "closed": 0.875}
    rest = {"share_of_gap": 0.125, "predictable": 0.5, "where": [], "text": ["40% of the error in 9%: end of stroke"]}
    assert "12.5 % of the gap stay unexplained: 40% of the error in 9%: end of stroke." in sentences(
        typed(FOUND | {"gap": gap, "unexplained": rest})
    )
    at_floor = FOUND | {"gap": gap | {"after": 0.0105}, "unexplained": rest}
    assert not any("unexplained" in line for line in sentences(typed(at_floor)))


def test_an_effect_stands_for_the_set_it_cannot_be_told_from():
    assert any("with eddy-current standing for the set" in line for line in sentences(typed(AMBIGUOUS)))
    assert next_step(typed(AMBIGUOUS)) == ""


@pytest.mark.parametrize(("found", "is_said"), [(NONE, True), (FOUND, True), (UNEXPLAINED, False)])
def test_a_formula_that_was_asked_for_and_not_looked_for_is_said(found: dict[str, object], is_said: bool) -> None:
    for asked in (False, True):
        said = " ".join(sentences(typed(found | {"settings": {"formulas": asked}})))
        assert ("No formula was looked for" in said) == (asked and is_said)


def test_the_command_that_goes_on_keeps_the_dependence_on_current():
    dependence = {"orders": [["fy", 2], ["c", 1]], "low": 0.0, "high": 2.0}
    found = FOUND | {"augmented_model": "tanh+current-lag", "current_dependence": dependence}
    assert next_step(typed(found)) == "mrfit fit --model tanh+current-lag --current-order fy=2,c=1 --per all"


def test_a_form_that_was_chosen_is_in_words_on_the_page():
    told = discovery._dependence(
        DiscoveryDependence(orders=(("fy", 2), ("alpha", "plain2"), ("c", "log1")), low=0.0, high=2.0)
    )
    assert told == "fy of order 2, alpha of order 2 (plain), c of order 1 (log), 0 to 2 A"


def test_parameters_are_read_in_a_fitting_unit_and_an_open_interval_is_said():
    shown = parameter_rows(FoundEffect.model_validate_json(json.dumps(EFFECT)))[0]
    assert (shown.value, shown.interval) == ("2.100 ms", "2.050 to 2.150 ms")
    open_ended = {**EFFECT, "parameters": [EFFECT["parameters"][0] | {"low": None, "high": None}]}
    assert parameter_rows(FoundEffect.model_validate_json(json.dumps(open_ended)))[0].interval == "not determined"


def test_nearly_all_is_not_called_all():
    assert [closed_share(v) for v in (0.5, 0.9976, 0.99996, 1.0)] == ["50.0", "99.76", "100.0", "100"]


def test_no_discovery_and_changed_segments_are_errors_with_a_remedy(tmp_path):
    with pytest.raises(DataError, match=r"no discovery here; run `mrfit discover"):
        discovery.run(Workspace(tmp_path / "none"))
    workspace = study(tmp_path / "w", FOUND)
    (workspace.root / "discover" / "residuals.parquet").rename(tmp_path / "kept")
    with pytest.raises(DataError, match=r"residuals.parquet: is missing; delete .*discover and run"):
        discovery.run(workspace)
    (tmp_path / "kept").rename(workspace.root / "discover" / "residuals.parquet")
    segments = workspace.read_segments()
    workspace.write_segments(segments[1:], {})
    with pytest.raises(DataError, match=r"segments have changed since; run `mrfit discover` again"):
        discovery.run(workspace)


def test_advice_is_the_last_discoverys(tmp_path):
    workspace = study(tmp_path, AMBIGUOUS)
    told = {k: AMBIGUOUS[k] for k in ("base_model", "verdict", "ambiguous_set", "advice")}
    assert json.loads(json.dumps(asdict(discovery.advice(workspace)))) == told | {"outdated": False, "reason": ""}


OPEN = FOUND | {
    "base_model": "bingham",
    "held": [["gas-spring.k_g", 9030.0]],
    "augmented_model": "bingham+gas-spring",
    "effects": [EFFECT | {"name": "gas-spring", "parameters": [
        {"name": "k_g", "unit": "N/m", "value": 9030.0, "low": 8940.0, "high": 9120.0}]}],
    "law_gap": {
        "error": 0.054, "share": 0.96, "effects": 0.03, "rest": 0.01, "left": 0.006, "taken": 0.99,
        "text": ["within 1.6 mm of a reversal (75 % of it in 20 % of the samples)"],
    },
    "confounded": [{"name": "stribeck", "reason": "any law may have it <b>", "test": "slow strokes"}],
    "invariance": {
        "named": [{"name": "gas-spring", "breaks": "position", "tier": "short-memory",
                   "standing": {"share": 0.99, "kept": 0.98, "held": 0.97, "size": 0.05, "z": 50.0, "left": 0.2,
                                "improved": 1.0}}],
        "turned_down": [{"name": "inertia", "breaks": "memory", "reason": "takes only 1%"}],
        "travel": 0.003, "travel_unit": "m",
    },
    "other_laws": [{"model": "guo", "holdout_nrmse": 0.01, "takes": 0.91, "takes_beside": 0.95, "floors": 3.0,
                    "command": "mrfit discover --model guo"}],
}  # fmt: skip


def test_the_page_tells_effects_the_law_and_other_laws_apart(tmp_path):
    text = discovery.render(replace(read_discovery(study(tmp_path, FOUND)), found=typed(OPEN)), "k")
    parsed = Page(text)
    assert not parsed.open and not parsed.unbalanced
    assert {"tested", "laws", "confounded"} <= set(parsed.tables)
    for said in (
        "bingham lacks stiffness of the gas accumulator (gas-spring), and its law itself is off.",
        "bingham itself errs by 5.40 % of the range, 96 % of its gap, most of all within",
        "of which gas-spring takes 99 %",
        "any law may have it &lt;b&gt;",
        "mrfit discover --model guo",
        "--fix gas-spring.k_g=9030",
    ):
        assert said in text, said
    rows = {cells[0]["text"]: cells for cells in parsed.tables["tested"][1:]}
    assert plain(rows["gas-spring"][2]["shown"][0]) == pytest.approx(99.0)
    assert (rows["gas-spring"][6]["text"], rows["inertia"][6]["text"]) == ("yes", "no")
    assert plain(parsed.tables["laws"][1][2]["shown"][0]) == pytest.approx(95.0)


def test_without_an_effect_nothing_is_drawn_twice(named, monkeypatch):
    found = read_discovery(named)
    same = replace(found, parts=[replace(p, after=p.before) for p in found.parts])
    canvases: dict = {}
    monkeypatch.setattr(
        discovery_figures, "to_svg", lambda canvas, title: canvases.setdefault(title, canvas) and "<svg/>"
    )
    figures = {f.name: f for f in discovery_figures.figures_of(same)}
    assert not any("before" in f.title or "after" in f.title for f in figures.values())
    assert len(canvases["Residual map"].axes) == 2  # the map and its scale
    loop = canvases["Flux–current loop"].axes[0]
    assert [line.get_label() for line in loop.lines] == ["measured", found.found.base_model]
    dots = [line.get_label() for line in canvases["NRMSE"].axes[0].lines]
    assert "after" not in dots and found.found.base_model in dots


def test_residuals_are_measured_minus_simulated_as_on_the_report(drawn, named):
    part = discovery_figures.worst_parts(read_discovery(named))[0]
    line = next(one for one in drawn["Residual before and after"].axes[0].lines if one.get_label() == "before")
    x, y = line.get_data()
    scale = y.min() / -part.before.max()
    assert scale > 0.0
    assert y[0] == pytest.approx(-scale * part.before[0])


def test_of_an_effect_that_is_not_the_cause_one_number_is_said_and_nothing_is_drawn_that_agrees(tmp_path):
    suspects = [
        {"name": "eddy-current", "parameters": EFFECT["parameters"], "holdout_nrmse_after": 0.02, "closed": 0.4}
    ]
    found = UNEXPLAINED | {"suspects": suspects, "other_laws": OPEN["other_laws"]}
    text = discovery.render(replace(read_discovery(study(tmp_path, found)), found=typed(found)), "k")
    assert "would take 40.0 % of the gap" in text and text.count('<data value="0.4">40.0</data>') == 2
    assert "89.0" not in text and "would do" not in text
    # what to do stands before what is known
    assert text.index("guo is nearer") < text.index("mrfit discover --model guo") < text.index("would take 40.0 %")


def test_a_suspect_is_drawn_as_its_force_beside_what_is_left_without_it(tmp_path):
    suspects = [
        {"name": "eddy-current", "parameters": EFFECT["parameters"], "holdout_nrmse_after": 0.02, "closed": 0.4}
    ]
    workspace = study(tmp_path, AMBIGUOUS | {"suspects": suspects})
    table = tmp_path / "discover" / "residuals.parquet"
    columns, _ = read_table(table)
    own = np.sin(np.arange(len(columns["before"])) / 9.0) * 1e-3
    # the effect takes 0.6 of what is left without it
    write_table(table, {**columns, "with eddy-current": -0.4 * own, "without eddy-current": -own})
    found = read_discovery(workspace)
    drawn = found.parts[0].contributions["eddy-current"]
    rows = slice(0, len(drawn.force))
    assert drawn.remainder == pytest.approx(own[rows]) and drawn.force == pytest.approx(0.6 * own[rows])
    discovery.run(workspace)
    text = (tmp_path / "discover" / "discovery.html").read_text(encoding="utf-8")
    assert "What eddy-current would do" in text and "eddy-current as fitted" in text
    # one number for the effect, the same in the caption and in both tables
    assert "It takes 89.0 % of the squared error on held-out conditions." in text
    assert text.count('<data value="0.89">89.0</data>') == 2
    assert "Cannot be judged: integrator-offset (no integrator)." in text
