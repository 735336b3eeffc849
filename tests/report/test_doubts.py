from dataclasses import replace

from mrfit.io.schemas.stages import FoundOddity
from mrfit.report.doubts import doubts
from mrfit.report.page import render
from mrfit.report.source import ReportSource, read_source


def with_finding(
    source: ReportSource, kind: str, channel: str, text: str = "velocity is 1/25.4 <of> the slope"
) -> ReportSource:
    found = [FoundOddity(kind=kind, channel=channel, at=None, text=text)]
    recordings = [replace(r, findings=found) for r in source.ingest.recordings]
    return replace(source, ingest=replace(source.ingest, recordings=recordings))


def test_a_finding_on_a_channel_of_the_model_stands_beside_the_verdict(damper):
    source = with_finding(read_source(damper[0], ()), "velocity-differs", "velocity")
    (found,) = doubts(source.fits[0], source)
    assert (found.kind, found.count, found.total, found.recording) == ("velocity-differs", 3, 3, "damper-0")
    page = render(source, {source.fits[0].name: []})
    verdict = page[page.index("<h3>Verdict</h3>") : page.index("<h3>What was run</h3>")]
    assert "3 of 3 recordings, as damper-0" in verdict and "1/25.4 &lt;of&gt; the slope" in verdict


def test_channels_that_the_model_does_not_use_raise_none(damper):
    source = with_finding(read_source(damper[0], ()), "clipped", "temperature")
    assert doubts(source.fits[0], source) == []


def test_findings_that_change_no_physics_raise_none(damper):
    source = with_finding(read_source(damper[0], ()), "comments", "velocity")
    assert doubts(source.fits[0], source) == []
