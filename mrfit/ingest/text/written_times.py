"""Times at which rows were taken, in forms that people and programs print: as ``28-Nov-2026 12:00:00.002`` or a clock.

A day that is counted, not dated, is left out: where the clock goes through midnight, the next day is seen.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from mrfit.ingest.text.layout import MONTH

FIELD_BEGIN, FIELD_END = r'(?m:^|(?<=[,;\t|"]))[ ]*', r'(?m:(?=[ ]*(?:[,;\t|"\r]|$)))'
"""Where a field begins and ends."""
DAY_NAME = r"(?i:mon|tue|wed|thu|fri|sat|sun|mo|di|mi|do|fr|sa|so)[a-z]*\.?,? +"
CLOCK_TEXT = r"(\d{1,2}:[0-5]\d:[0-5]\d(?:[.,]\d+)?(?: ?[AaPp]\.?[Mm]\.?)?)"
SECONDS_TEXT = r"([0-5]\d(?:[.,]\d+)?)"


@dataclass(frozen=True, slots=True)
class WrittenTime:
    """A form of times, what all of its texts hold, and what stands for it, with the groups of the form."""

    form: re.Pattern[str]
    mark: str
    plain: str | Callable[[re.Match[str]], str]

    def rewritten(self, text: str) -> str:
        """Return a text with these times in the plain form."""
        return self.form.sub(self.plain, text)


def _form(form: str, mark: str, plain: str | Callable[[re.Match[str]], str]) -> WrittenTime:
    return WrittenTime(re.compile(f"{FIELD_BEGIN}{form}{FIELD_END}"), mark, plain)


def _of_parts(match: re.Match[str]) -> str:
    """Return hours, minutes and seconds as a time of day, in which each has two digits."""
    hours, minutes, seconds = (part or "0" for part in match.groups())
    return f"{hours:0>2}:{minutes:0>2}:{'0' * (not seconds[1:2].isdigit())}{seconds}"


TIME_FORMS = (
    _form(rf"(\d{{4}})(\d\d)(\d\d)[T_ ](\d\d):?(\d\d):?{SECONDS_TEXT}(Z?)", "20", r"\1-\2-\3T\4:\5:\6\7"),
    _form(rf"(\d{{4}}-\d\d-\d\d)[_ T](\d\d)-(\d\d)-{SECONDS_TEXT}", "-", r"\1 \2:\3:\4"),
    _form(rf"(?:{DAY_NAME})?({MONTH})\.? +(\d\d?) +{CLOCK_TEXT} +(\d{{4}})", ":", r"\2-\1-\4 \3"),
    _form(rf"(?:{DAY_NAME})?({MONTH})\.? +(\d\d?),? +(\d{{4}}),? +{CLOCK_TEXT}", ":", r"\2-\1-\3 \4"),
    _form(rf"(?:{DAY_NAME})?(\d\d?)\.? +({MONTH})\.?,? +(\d{{4}}),? +{CLOCK_TEXT}", ":", r"\1-\2-\3 \4"),
    _form(rf"(\d{{4}})年(\d\d?)月(\d\d?)日 ?(\d\d?)[时時点](\d\d?)分{SECONDS_TEXT}秒", "年", r"\1/\2/\3 \4:\5:\6"),
    _form(r"(\d\d?) ?h ?(\d\d?) ?m(?:in)? ?([0-5]?\d(?:[.,]\d+)?) ?s", "h", _of_parts),
    _form(rf"\d+ days? {CLOCK_TEXT}", "day", r"\1"),
    _form(r"PT(?:(\d\d?)H)?(?:(\d\d?)M)?(\d\d?(?:\.\d+)?)S", "PT", _of_parts),
    _form(rf"(?:\d{{4}}-)?[0-3]\d\d[T:/ ]{CLOCK_TEXT}", ":", r"\1"),
    _form(r"([0-5]?\d:[0-5]\d[.,]\d+)", ":", r"00:\1"),
    _form(rf"[\['](\d[\dT:./ -]*:{SECONDS_TEXT})\]?", ":", r"\1"),
)


def written_times(sample: str) -> Iterator[Callable[[str], str]]:
    """Yield functions that rewrite the times of a log, of which some lines are seen."""
    for form in TIME_FORMS:
        if form.mark in sample and form.form.search(sample):
            yield form.rewritten
