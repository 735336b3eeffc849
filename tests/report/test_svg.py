import re
from xml.etree import ElementTree

import matplotlib
import pytest
from matplotlib.figure import Figure

from mrfit.report.svg import inline, style, to_svg


@pytest.fixture(scope="module")
def drawing() -> str:
    with style():
        figure = Figure(figsize=(3.0, 2.0))
        axes = figure.subplots()
        axes.plot([0.0, 1.0 / 3.0, 2.0], [1.0, 5.0, 2.0], "o-")
        axes.set(title="a < b & $c$", xlabel="Flux λ (mWb)")
        return to_svg(figure, "one")


def test_drawing_is_xml_without_date_and_with_its_title(drawing):
    root = ElementTree.fromstring(drawing)
    assert root.tag.endswith("svg")
    assert "one" in [e.text for e in root.iter() if e.tag.endswith("title")]
    assert not [e for e in root.iter() if e.tag.endswith("date")]


def test_text_stays_text_and_no_dollar_is_taken_for_math(drawing):
    texts = "".join(ElementTree.fromstring(drawing).itertext())
    assert "Flux λ (mWb)" in texts and "a < b & $c$" in texts


def test_coordinates_are_short(drawing):
    paths = " ".join(re.findall(r' d="([^"]*)"', drawing))
    assert paths and not re.search(r"\.\d{3}", paths)


def test_inline_drawing_has_prefixed_ids_only_and_no_address(drawing):
    body = inline(drawing, "f1", 'loop "A" < B')
    root = ElementTree.fromstring(body.replace("xlink:href", "href"))
    assert root.get("role") == "img" and root.get("aria-label") == 'loop "A" < B'
    ids = {e.get("id") for e in root.iter() if e.get("id")}
    assert ids and all(i.startswith("f1-") for i in ids)
    used = set(re.findall(r'(?:href="|url\()#([^")]+)', body))
    assert used and used <= ids
    assert "http" not in body


def test_style_leaves_the_users_settings_as_they_were():
    before = dict(matplotlib.rcParams)
    with style():
        assert matplotlib.rcParams["svg.hashsalt"] == "mrfit"
    assert dict(matplotlib.rcParams) == before
