"""The sample interval that a header states as rate or interval."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

from mrfit.core.recording import Finding
from mrfit.ingest.meaning import units
from mrfit.ingest.meaning.channel_map import FILE_NAME
from mrfit.ingest.refusal import Refusal, excerpt
from mrfit.ingest.table import Table
from mrfit.ingest.text.body import split
from mrfit.ingest.text.layout import COMMENTS, name_and_unit

RATE_NUMBER = r"(?:(?<!\d)\d{1,3}(?:[ \u00a0\u202f]\d{3}(?!\d))+|\d(?:\d|[.,'](?=\d))*\.?|\.\d+)"
RATE_SAMPLES = r"(?:samples?|scans?|readings?|(?:mess)?werte)"
SAMPLES_EACH_SECOND = rf"[km]?(?:sps|sa/s|s/s|{RATE_SAMPLES} ?(?:/|per|pro) ?(?:s(?:ec(?:onds?|\.)?)?|min(?:ute)?)\b)"
EACH_SECOND = rf"(?:{SAMPLES_EACH_SECOND}|1?/s)"
SPAN_UNIT = r"[muµn]?s(?:ec(?:onds?)?)?"
_NEXT = r"(?<![\w.,])(?="
"""Where a number begins that comes before the words for what it is."""
_SOME = r"\W{0,12}\d[\d.,e+-]{0,20}[\s,;]{0,4}"
_SOME_HZ, _SOME_S = rf"{_SOME}(?:[km]?hz|{EACH_SECOND})", rf"{_SOME}{SPAN_UNIT}\b"
"""A number with its unit; of few letters, as all marks may be alike."""
WORDED_LABEL = (
    r"(?:(?:sampl(?:e|ing)|acquisition|scan|daq)|(?P<other>(?:log(?:g(?:ing|ed))?|record(?:ing)?|stor(?:e|ed|age|ing)"
    r"|(?<!auto)(?<!auto[-_ ])sav(?:e|ed|ing)|data|writ(?:e|ing)|export|reduced|effective|output|final)"
    r"(?=[ _]*(?:rate|interval|frequency))))[ _]*(?P<word>rate|freq(?:uency)?|interval|period|time)(?![a-z])"
)
"""Of a rate or an interval, as its last word says."""
_NOT_TO_SAMPLE = " (?:delay|jitter|window|aperture|gate|clock)"
OF_SAMPLING = r"(?:sampling|sampled at|(?:sampled|logging|logged|recorded) every)"
"""Words beside which a number with its unit is a rate or an interval, as the unit says."""
SAMPLING_PERHAPS = (
    r"(?:(?:ab)?tast(?:ung|rate|frequenz|intervall|zeit|periode)|messrate|campionamento|[ée]chantillonnage|muestreo"
    rf"|amostragem|дискретизации|采样|サンプリング|{RATE_SAMPLES} every)"
)
"""The same in words of which others may be meant, as those of a filter or of a slow channel."""
RATE_LABELS = (
    r"samples?[ _]?(?:per|/)[ _]?s(?:ec(?:onds?)?)?\b",
    r"(?:abtast|mess)(?:rate|frequenz)",
    r"采样(?:频率|率)|サンプリング(?:周波数|レート)|частота дискретизации",
    r"fr[ée]quence d.?[ée]chantillonnage|frecuencia de muestreo|frequenza di campionamento|frequ[êe]ncia de amostragem",
    rf"{OF_SAMPLING}(?={_SOME_HZ})",
    rf"(?<!\w)(?:f_?s(?={_SOME_HZ}|\W*[(\[][km]?hz[)\]]\W*\d)|(?-i:fs)(?=\W*\d+ *$)|sps(?= *[:=] *\d+$))",
    rf"(?<!\w)rate(?=\W*[\d.,e+]+ ?{SAMPLES_EACH_SECOND})",
)
SPAN_LABELS = (
    rf"(?<!\w)(?:dt|Δt|delta[ _]?t)(?={_SOME_S}|\W*(?:0?[.,]\d+$|[\d.,]+e-\d+))",
    rf"(?<!\w)(?:ts|dx)(?= *[:=]{_SOME_S})|^\W*clock(?= *[:=]{_SOME_S})|^dx:[\t;]|^\W*hresolution",
    rf"^\W*(?:time )?intervall?(?=\W*[muµn]?s\W|{_SOME_S})",
    rf"{OF_SAMPLING}(?={_SOME_S})",
    r"abtast(?:intervall|zeit|periode)|time per (?:point|sample)|storage cycle",
    r"采样(?:间隔|周期)|サンプリング(?:間隔|周期)|период дискретизации",
    r"p[ée]riode d.?[ée]chantillonnage|per[ií]odo de muestreo|periodo di campionamento",
)
ASSUMED_RATES = (
    r"^\W*rate(?=\W*[\d.,e+]+ ?[km]?hz\W*$)",
    r"[(\[](?:[kmµ]?n|[mµ]?m|[mk]?v|m?a|lbf|in)[)\]] ?@(?= ?[\d.,]+ ?[km]?hz\b)",
    rf"{SAMPLING_PERHAPS}(?={_SOME_HZ})",
    rf"(?:acquisition|acquired|recorded|logged) (?:at|with)(?={_SOME_HZ})",
    rf"{_NEXT}{RATE_NUMBER} ?{SAMPLES_EACH_SECOND})",
    rf"{_NEXT}{RATE_NUMBER} ?[km]?hz (?:sampling|acquisition|daq)\b(?!\D{{0,12}}\d))",
)
ASSUMED_SPANS = (
    rf"{SAMPLING_PERHAPS}(?={_SOME_S})",
    rf"{_NEXT}{RATE_NUMBER} ?{SPAN_UNIT} (?:sampling|acquisition)\b(?!{_NOT_TO_SAMPLE}|\D{{0,12}}\d))",
    rf"{_NEXT}{RATE_NUMBER} ?{SPAN_UNIT}(?:/| per ){RATE_SAMPLES}\b)",
)
"""Words for a rate or an interval that may be another's than the rows'."""
STATED_RATE = re.compile(
    rf"(?P<label>(?:{WORDED_LABEL}|{'|'.join(RATE_LABELS)}|(?P<span>{'|'.join(SPAN_LABELS)})"
    rf"|(?P<assumed>{'|'.join(ASSUMED_RATES)}|(?P<assumed_span>{'|'.join(ASSUMED_SPANS)})))[^0-9+-]*?)"
    rf"\+?(?P<number>{RATE_NUMBER})(?P<power>e[+-]?\d+)?"
    rf"(?!\d|[:/-]\d| \d(?!/s))[ \u00a0]*(?P<behind>{EACH_SECOND}|{SPAN_UNIT}(?:/| per ){RATE_SAMPLES}|[a-zµ/]*)"
    r"[\s,;]*(?P<beside>[a-zµ/]*)",
    re.IGNORECASE,
)
"""Label with its word, number, power of ten, the unit behind it, and what stands in the next field."""
SPAN_WORDS = ("interval", "period", "time")
OTHERWISE = re.compile(
    r"\b(?:max\w*|(?<!/)min(?:imum|imal|\.)?|highest|lowest|fastest|limits?|up to|displays?|screen|updates?|refresh"
    r"|plot|graph|chart|preview|view|length|duration|record(?:ing)? (?:time|period)"
    r"|between|of (?:the )?(?:record|recording|test|run|file)|all channels|multiplex\w*|total|aggregate|overall"
    r"|filt\w*|cut-?off|band(?:width|breite)"
    r"|valve|actuator|pump|motor|pid|regulator"
    r"|requested|target|default|available|possible|supported|original|internal|raw|adc|over-?sampl\w*|video|camera|servo|control(?:ler)?|loop|before|prior|capab\w*"
    r"|previous|earlier|low-?pass)\b",
    re.IGNORECASE,
)
"""Words beside a rate that need not be the rate of the rows."""
OF_OTHER_CHANNELS = re.compile(r"\b(?:probe|encoder|laser|thermo\w*|temperatur\w*)", re.IGNORECASE)
"""Words beside which a rate without words of its own is that of another channel."""
OF_A_SIGNAL = re.compile(
    r"[ -]{0,2}(?:mains|hum\b|sine|excit|driv|dither|pwm|carrier|sweep|vibrat|anti-?alias|noise|line\b)", re.IGNORECASE
)
"""Words behind a frequency that is a signal's."""
HUM_BEFORE = re.compile(r"\b(?:mains|hum)[^\w,;]{1,3}(?:\w+ )?$", re.IGNORECASE)
LONGEST_LINE = 1000
"""Letters of a line in which a rate is looked for: what is longer is a line of a table, or hostile."""
ROUGHEST = 0.02
"""Rates that differ by more are two, however few digits they have."""
LONG_PERIOD = 0.5
"""Period or time in s from which a header may mean the length of a record."""
SLOWEST_ASSUMED = 50.0
"""Rate in Hz from which a bare one is none of a test: dampers are moved more slowly, and sampled faster."""
LONG_BARE = 1.0
"""Interval in s above which a number without a unit may mean ms or kHz."""
DECIMATION = re.compile(
    r"decimat\w*|(?:down|sub|under)-?sampl\w*|thinn\w*|reduction|(?:re|over)-?sampl\w*|averag(?:es|ing)\b|n-?th sample"
    r"|averaged? (?:samples|points|values)|(?:samples|points|values) averaged"
    r"|skip(?:ped|ping)? (?:factor|samples?|points?)|(?:samples?|points?|rows?) skipped|divi(?:der|sor)\b"
    r"|(?:sav|stor|writ|record|log|export|kep|keep)\w* (?:only )?(?:every|one (?:of|in)|1 (?:of|in)|each)"
    r"(?: ?n(?:-?th)?\b)?(?: (?:sample|point|row|scan|value|reading)s?)?|every n-?th\b"
    r"|unterabtast\w*|untersetz\w*|jede[nrs]? n-?te\w*",
    re.IGNORECASE,
)
"""Labels of a number of samples for each one that was kept."""
NOT_DECIMATED = re.compile(
    r"[ _]*(?:factor|ratio|rate|by|of)?\W*(?:none|off|no|not? (?:used|active)|disabled|false|[01](?:[.,]0*)?|1:1)?\W*"
    r"|\W*[\d.,]+ ?(?:[muµ]?s|msec|sec(?:onds?)?)\b.*",
    re.IGNORECASE,
)
"""What stands behind where nothing was left out."""
THINNED = re.compile(
    r"(?:every|each) (?:\d+ ?(?:st|nd|rd|th)|\d+ (?=sample|point|scan|value|reading)|other|second|third|fourth|fifth"
    r"|eighth|tenth|hundredth) (?:sample|point|row|scan|value|reading|datum)"
    r"|averag\w* (?:over |of |every )?\d+ ?(?:samples|points|values|x\b|times)|(?<!not )\bdecimated$",
    re.IGNORECASE,
)
"""Statements that not every sample was kept."""
GROUPED = re.compile(r"[1-9]\d{0,2}([., '\u00a0\u202f])\d{3}((?:\1\d{3})*(?:[.,]\d+)?)")
"""A number whose first mark may part thousands, and what follows on the first group."""


@dataclass(frozen=True, slots=True)
class Statement:
    """An interval in s that a header states in certain words.

    ``open`` is how far its last digit leaves it open, relatively; ``bare`` says that no unit was written.
    """

    text: str
    interval: float
    open: float
    bare: bool = False

    @property
    def is_bare_and_long(self) -> bool:
        """Whether it has no unit, and would be so long in the usual one that another may be meant."""
        return self.bare and self.interval > LONG_BARE

    def agrees(self, other: "Statement") -> bool:
        """Whether both may be of one interval."""
        return abs(self.interval / other.interval - 1.0) <= self.open + other.open + 1e-6


def stated_interval(
    lines: Sequence[str], delimiter: str = ",", decimal: str = "."
) -> tuple[float | None, tuple[Finding, ...]]:
    """Return the sample interval in s that a header states, or None, and a finding if it states none without a doubt.

    In doubt are numbers that can be read in two ways, rates that differ, rates of a display or at most, lengths of a
    record, and a rate beside a decimation.

    Parameters
    ----------
    lines
        The header.
    delimiter, decimal
        Of the rows; ``decimal`` is empty where they do not show it.
    """
    clear: list[Statement] = []
    rivals: list[Statement] = []
    assumed: list[Statement] = []
    doubtful: list[str] = []
    lines = [line[:LONGEST_LINE] for line in lines]
    of_tables = _stacked(lines, delimiter)
    for line, in_table in [*((line, False) for line in lines), *((line, True) for line in of_tables)]:
        for match in STATED_RATE.finditer(line):
            found = _statement(match, delimiter, decimal)
            if isinstance(found, str):
                return None, (_unclear(f"the header's '{found}' can be read in more than one way"),)
            if found is None:
                continue
            if match["other"]:
                rivals.append(found)
            elif OTHERWISE.search(_around(match)) or _is_duration(match, found) or found.is_bare_and_long:
                doubtful.append(found.text)
            elif match["assumed"] is not None or in_table:
                slow = found.interval > 1.0 / SLOWEST_ASSUMED
                assumed += [] if slow or _is_another(match) else [found]
            else:
                clear.append(found)
    if not (clear or rivals or doubtful) and len({a.interval for a in assumed}) == 1:
        text = f"the header's '{assumed[0].text}' is taken as the rate of the rows; a channel map can say another"
        return assumed[0].interval, (Finding("rate-assumed", "", None, text),)
    if not clear:
        said = doubtful + [r.text for r in rivals]
        return None, (_unclear(f"the header's '{said[0]}' may not be the rate of the rows"),) if said else ()
    if other := next((s for s in (*clear, *rivals) if not s.agrees(clear[0])), None):
        return None, (_unclear(f"the header states '{clear[0].text}' and '{other.text}'"),)
    if thinned := next((line for line in lines if _is_decimation(line)), None):
        text = f"the header states '{clear[0].text}' and '{excerpt(thinned)}', and not which rate the rows have"
        return None, (_unclear(text),)
    best = min(clear, key=lambda s: s.open)
    return best.interval, _beside(best, assumed)


def _beside(best: Statement, assumed: Sequence[Statement]) -> tuple[Finding, ...]:
    """Return a finding on a rate that is not taken, as another one is clear."""
    other = next((a for a in assumed if not a.agrees(best)), None)
    if other is None:
        return ()
    text = f"the header's '{best.text}' is taken as the rate of the rows, not '{other.text}'"
    return (Finding("rate-assumed", "", None, f"{text}; a channel map can say another"),)


def _stacked(lines: Sequence[str], delimiter: str) -> list[str]:
    """Return as single statements what a small table says, as ``Samples,Rate`` above ``800,500 Hz``."""
    cells = [split(line.lstrip(COMMENTS), delimiter) for line in lines]
    pairs = [zip(a, b, strict=True) for a, b in pairwise(cells) if len(a) == len(b) > 1]
    return [f"{n}: {v}" for pair in pairs for n, v in pair if n and v[:1].isdigit() and not n[:1].isdigit()]


def _unclear(text: str) -> Finding:
    return Finding("rate-unclear", "", None, f"{text}: not used")


def _statement(match: re.Match[str], delimiter: str, decimal: str) -> Statement | str | None:
    """Return the statement of a header, or its text where a mark may mean two things; None where it is no rate."""
    label, number, power, behind, beside = match.group("label", "number", "power", "behind", "beside")
    kind = kind_stated(match)
    text = match.string[match.start() : match.end("behind" if behind else "beside")].strip(" ,;\t")
    written = _unit(behind, name_and_unit(label.rstrip(' \t:=,;"'))[1], beside, kind)
    if written is None:
        return None
    unit = written or kind
    plain = _plain(number.rstrip("."), delimiter, decimal, bool(behind))
    if plain is None:
        return text
    try:
        value = float(plain + (power or ""))
    except ValueError:
        return None
    if not 0.0 < value < float("inf"):
        return None
    # a whole number is meant as it stands
    last = 0.5 * 10.0 ** (int((power or "e0")[1:]) - len(plain.partition(".")[2])) if "." in plain or power else 0.0
    return Statement(text, interval(value, unit), min(last / value, ROUGHEST), not written)


def kind_stated(match: re.Match[str]) -> str:
    """Return ``s`` where a match of ``STATED_RATE`` is of an interval, and ``Hz`` where it is of a rate."""
    of_span = match["span"] is not None or match["assumed_span"] is not None
    return "s" if of_span or (match["word"] or "").lower() in SPAN_WORDS else "Hz"


def _is_another(match: re.Match[str]) -> bool:
    """Whether a rate without words of its own is that of another channel, or the frequency of a signal."""
    behind = OF_A_SIGNAL.match(match.string, match.end("behind")) or HUM_BEFORE.search(match.string[: match.start()])
    return behind is not None or OF_OTHER_CHANNELS.search(_around(match)) is not None


def _around(match: re.Match[str]) -> str:
    """Return the part of a line in which a statement stands."""
    before, behind = match.string[: match.start()], match.string[match.end() :]
    return (re.split(r"[,;|\t]", before)[-1] + match[0] + re.split(r"[;|\t]", behind)[0]).replace("_", " ")


def _is_duration(match: re.Match[str], found: Statement) -> bool:
    """Whether a time or a period is so long that it may be the length of the record, or of something else."""
    return (
        (match["word"] or "").lower() in ("time", "period") or match["span"] is not None
    ) and found.interval >= LONG_PERIOD


def _is_decimation(line: str) -> bool:
    """Whether a line says that not every sample was kept."""
    label = DECIMATION.search(line)
    return bool(THINNED.search(line)) or label is not None and not NOT_DECIMATED.fullmatch(line[label.end() :])


def rate_missing(path: Path | str, names: Sequence[str], unclear: str = "") -> Refusal:
    """Return the refusal of a log with columns of these names that has neither times nor a rate."""
    shown = ", ".join(f"'{n}'" for n in names)
    remedy = f"write rate = HZ, or time = COLUMN, in a channel map ({FILE_NAME} beside the log, or --map)"
    return Refusal(path, f"no time column and no sample rate (columns: {shown}{unclear})", remedy)


def with_rate(table: Table, lines: Sequence[str], delimiter: str = ",", decimal: str = ".") -> Table:
    """Return a table with the interval that its header states, if it states one."""
    dt, findings = stated_interval(lines, delimiter, decimal)
    if table.time is not None and any(f.kind == "rate-assumed" for f in findings):
        return table  # the times say it
    return replace(table, dt=dt, findings=(*table.findings, *findings))


def interval(value: float, unit: str) -> float:
    """Return the sample interval in s of a rate or an interval."""
    if units.compatible(unit, "s"):
        return value * units.to_unit(unit, "s").scale
    return 1.0 / (value * units.to_unit(unit, "Hz").scale)


def _unit(behind: str, before: str | None, beside: str, kind: str) -> str | None:
    """Return the unit written behind a number, before it in brackets, or in the next field; else an empty text."""
    if behind:
        return of_kind(behind, kind)
    return of_kind(before or "", kind) or of_kind(beside, kind) or ""


def of_kind(text: str, kind: str) -> str | None:
    """Return a unit of a rate (Hz) or an interval (s) as it can be converted, ``kS/s`` as kHz; None if it is none."""
    each = re.fullmatch(EACH_SECOND, text, re.IGNORECASE) if kind == "Hz" else None
    unit = f"{text[0] if text[0] in 'kM' else ''}Hz" if each else re.sub(rf"(?:/| per ){RATE_SAMPLES}$", "", text)
    unit = "1/min" if each and "min" in text.lower() else unit
    return unit if unit and units.compatible(unit, kind) else None


def _plain(number: str, delimiter: str, decimal: str, united: bool) -> str | None:
    """Return ``1000``, ``1,000``, ``0,001`` or ``1 000`` with a decimal point only; None if a mark may mean two things.

    A mark before three digits parts thousands where it can be neither the decimal mark nor the delimiter: of two fields
    the second is no ``000``, and has no unit of its own (``united``).
    """
    if (grouped := GROUPED.fullmatch(number)) and (grouped[1] != "." or decimal == ","):
        mark, rest = grouped.groups()
        if mark == delimiter and len(set(each := number.split(mark))) == 1:
            return each[0]  # the same for every channel
        if mark == (delimiter or " ") and not united and number[number.index(mark) + 1] != "0":
            return None
        if mark in ".," and not rest and decimal != ".":
            return number.replace(",", ".") if mark == decimal else None
        return number.replace(mark, "").replace(",", ".")
    if delimiter == "," and not united and not number.startswith("0,"):
        number = number.partition(",")[0]
    plain = number.replace(",", ".")
    return plain if plain.count(".") < 2 else None
