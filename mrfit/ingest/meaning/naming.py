"""Give columns their channel names and SI units: by the map first, then by name, then by unit."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrfit.core.channels import CHANNELS, COLDEST, LARGEST, UNIT_NEEDED, unit_of
from mrfit.core.recording import Finding
from mrfit.core.specs import Array
from mrfit.errors import ConfigError
from mrfit.ingest import series
from mrfit.ingest.meaning import units
from mrfit.ingest.meaning.channel_map import ChannelRule, Rules
from mrfit.ingest.meaning.chosen import ignored_places, mapped_places, places_meant
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Column
from mrfit.ingest.text.layout import aliases_of, name_and_unit, unit_words, words_of

ANGULAR = ("angle", "angular_velocity", "angular_acceleration")
OF_DIFFERENCES = frozenset(
    "rise increase delta difference differenz übertemperatur uebertemperatur erwärmung erwaermung".split()
)
"""Words of columns that hold differences: a unit's zero does not matter to them."""
NOT_MEASURED = OF_DIFFERENCES | frozenset(
    "error err deviation fehler abweichung regelabweichung erreur errore demand demanded command commanded cmd set "
    "setpoint setting target desired reference ref soll sollwert sollkraft sollweg vorgabe consigne consigna "
    "riferimento limit limits lim limiter grenze grenzwert threshold alarm trip tolerance max maximum min minimum peak "
    "valley amplitude rms std offset tare zero predicted expected simulated simulation model modelled modeled "
    "preload setp sp nominal noise friction residual residuum ripple leakage "
    "lateral radial transverse transversal gap spalt luftspalt clearance thickness wear seitlich seitenkraft "
    "querkraft latéral lateralkraft spring clamp clamping grip inertia cooling vorspannkraft vorspannung spool "
    "diameter length level "
    # English and German
    "fit fitted calculated computed requested required programmed increment uncertainty maximale maximaler minimale "
    "minimaler reibung "
    # Italian, French, Spanish and Portuguese
    "impostata impostato comandata comandato richiesta richiesto programmata programmato obiettivo attrito "
    "massima massimo minima minimo picco scostamento simulata commandé commandée demandé demandée cible "
    "frottement erreur maximale minimal écart simulée fricción friccion rozamiento objetivo deseada deseado "
    "programada máxima máximo maxima mínimo desviación simulada limite límite desejada desejado "
    # Polish, Czech and Russian
    "zadany zadana zadane zadaná žádaná żądany żądana żądane "
    "заданный заданная заданное задание уставка требуемый требуемая требуемое ошибка ошибки погрешность погрешности "
    "рассогласование трение трения макс максимальный максимальная максимальное минимальный минимальная минимальное "
    "расчетный расчётный расчетная расчётная расчетное расчётное "
    # Chinese, Japanese and Korean
    "设定 设置 给定 预设 目标 指令 命令 期望 误差 偏差 摩擦 仿真 预测 最大 最小 峰值 极限 阈值 上限 下限 "
    "噪声 侧向 横向 設定 目標 要求 誤差 予測 설정 목표 지령 명령 요구 오차 편차 마찰 예측 최대 "
    "최소 한계".split()
)
"""Words of columns that say what was asked for, how far off it was, one number of many samples, or another quantity."""
NOT_MEASURED_COMPOUND = re.compile(
    r"soll(?:wert|strom|spannung|kraft|last|weg|hub|position|lage|geschw|temp)|reib(?:ungs)?(?:kraft|moment|wert)"
    r"|(?:maximal|minimal)[a-zäöüß]{3,}|[a-zäöüß]{3,}(?:grenz|abweichung|fehler)"
)
"""The same in one word, as German writes it."""
OF_SENSORS = frozenset(
    "sensor transducer transmitter loop lvdt cell loadcell gauge gage probe pickup encoder aufnehmer pressure "
    "druck flow strain humidity valve ventil ventilstrom servo trigger sync thermocouple thermoelement bridge brücke "
    "excitation supply battery batterie dac steuerspannung motor motorstrom moteur pump pumpe heater heizung fan "
    "compressor relay motore bomba pompa pompe batteria riscaldatore двигателя мотора насоса 电机 马达 伺服 泵 电池 "
    "加热 电源电压 传感器电压 传感器电流 モータ サーボ ポンプ ヒータ 電源電圧 センサ電圧 모터 서보 펌프 히터 전원전압 "
    "센서전압".split()
)
"""Words of columns whose amperes and volts are no coil's."""
OF_INPUTS = frozenset("channel chan analog input kanal eingang signal column data dev mod probe trace".split())
"""Words by which a recorder calls its inputs."""
OF_CONTAINERS = frozenset("signals signal values value data out1".split())
"""Parts of a path that name no quantity, but what programs keep one in."""
SIZE_SAMPLES = 20000
"""Numbers by which the size of a channel is judged."""
SAME_QUANTITY = 1e-3
"""Greatest difference, in the greatest value, of columns that hold one quantity in two units."""
RIVALLED, TOGETHER = ("displacement", "force"), 0.9
"""Channels that several instruments of one test may measure, and least correlation of their numbers."""
FEWEST_TOGETHER, HUGE = 20, 1e100
"""Fewest numbers that tell whether two columns move together, and the size from which no square is a number."""
OF_TREATED = frozenset("filtered smoothed raw".split())
"""Words of columns that hold the same again."""
OF_TESTERS = {
    **{"standardweg": "displacement", "standard travel": "displacement"},
    **{"standardkraft": "force", "standard force": "force"},
}
"""What a testing machine calls its own sensors, in units of others, too."""
LETTERS = re.compile(r"[a-zà-ɏ]+|[α-ԯ]+|[\u2e80-\uffff]+")
"""Letters of one script; the last one's put no blanks between words."""
LONGEST_PART = 6
"""Letters of the longest word that is looked for within a name of such a script."""
OF_COILS = re.compile("线圈|音圈|励磁|コイル|코일|катушк")
"""Words of a coil's current in such scripts, beside those for what it drives."""
OF_CURRENT_SENSORS = re.compile("电流传感器|電流センサ|전류 ?센서|датчик тока", re.IGNORECASE)
OF_SPECIMENS = re.compile(
    r"(?:最大|макс\.?|\bmax\.?|massim[ao]|máxim[ao]) ?\d+"
    r"|(?:横向|摩擦|마찰) ?(?:减振器|阻尼器|ダンパ|댐퍼)",
    re.IGNORECASE,
)
"""A sensor's range, and kinds of dampers, which hold words for what is not measured."""
LOOP = (3.6e-3, 21e-3)
"""Current in A of a sensor's loop of 4 to 20 mA."""


@dataclass(frozen=True, slots=True, eq=False)
class Signal:
    """A column with its channel name, its SI unit, and its values in that unit."""

    name: str
    unit: str
    values: Array
    index: int


def name_signals(columns: tuple[Column, ...], rules: Rules, path: str) -> tuple[list[Signal], list[Finding]]:
    """Return the signals of a table and what was assumed about them.

    Raises
    ------
    Refusal
        If the map names a column that is not there, or a unit of the map is unknown or of the wrong kind.
    ConfigError
        If the map makes two channels of one column.
    """
    left_out = ignored_places(rules, columns)
    there = [c for c in columns if c.index not in left_out]
    signals: list[Signal] = []
    mapped: dict[int, str] = {}
    findings: list[Finding] = []
    for name, rule in rules.channels.items():
        column = pick(there, rule.column, path, rules.where)
        if rule.unit is None and rule.scale == 1.0 and not _is_known(column):
            continue
        if other := mapped.get(column.index):
            what = (
                f"'channels.{other}' and 'channels.{name}' both name column '{column.name or column.index}' of {path}"
            )
            raise ConfigError(f"{rules.where}: keys {what}; give one of them another column, or remove it")
        mapped[column.index] = name
        signals.append(_mapped(name, rule, column, path))
    left = called_by_leaf([c for c in there if c.index not in mapped])
    claims = _claims(left, {s.name for s in signals}, findings)
    left = left if rules.believed else [_believed(c, claims, findings) for c in left]
    taken = {s.name for s in signals} | set(claims.values()) | {"time"}
    for column in left:
        claimed = claims.get(id(column))
        name = claimed or _own_name(column, taken)
        taken.add(name)
        signals.append(_unmapped(name, column))
    odd = [c for c in left if not _is_known(c)]
    for what, of_two in (("no known unit", False), ("the file gives one column two units", True)):
        if shown := ", ".join(f"'{c.name or c.index}' in '{c.unit}'" for c in odd if (" or " in str(c.unit)) == of_two):
            text = f"{what}: {shown}: kept as printed; write the unit in a channel map"
            findings.append(Finding("unknown-unit", "", None, text))
    for unit, what in (("g", "standard gravity, not gram"), ("G", "gauss, not gravity")):
        if meant := [f"'{c.name}'" for c in columns if c.unit is not None and c.unit.strip() == unit]:
            text = f"{', '.join(meant)}: the unit {unit} is taken as {what}"
            findings.append(Finding("unit-assumed", "", None, text))
    if weights := [f"'{c.name}' in {c.unit}" for c in left if claims.get(id(c)) == "force" and _is_weight(c)]:
        text = f"{', '.join(weights)}: a unit of mass, taken as that of a force"
        findings.append(Finding("unit-assumed", "force", None, text))
    unnamed = [c for c in there if c in left and c.unit is None and id(c) not in claims]
    perhaps = [c for c in unnamed if unit_words(c.name)]
    for found, what in (
        ([c for c in unnamed if c not in perhaps], "no unit and no known name"),
        (perhaps, "no known name, and whether a unit is in it cannot be told"),
    ):
        if shown := ", ".join(f"'{c.name or c.index}'" for c in found):
            findings.append(Finding("unnamed", "", None, f"{what}: {shown}; a channel map can name them"))
    return sorted(signals, key=lambda s: s.index), findings


def called_by_leaf(columns: list[Column]) -> list[Column]:
    """Return columns named by paths called by what differs; others, and those that would be called alike, as is."""
    read = leaf_names([c.name for c in columns])
    if not read:
        return columns
    return [
        replace(c, name=name, unit=unit if c.unit is None else c.unit)
        for c, (name, unit) in zip(columns, read, strict=True)
    ]


def leaf_names(names: Sequence[str]) -> list[tuple[str, str | None]]:
    """Return the parts that differ of names that are paths, as ``data.force_N`` or ``Model/Force[N]/Out1``, with units.

    None of other names, and of those that would be alike.
    """
    paths = [re.split(r"[./]", name.removeprefix("/")) for name in names]
    leaves = [[p for p in path if p.lower() not in OF_CONTAINERS] for path in paths]
    rooted = len({path[0] for path in paths}) == 1 or all(map(len, leaves)) and paths != leaves
    if (
        len(names) < 2
        or not rooted
        or any(len(p) < 2 or "" in p or not leaf for p, leaf in zip(paths, leaves, strict=True))
    ):
        return []
    last = [leaf[-1] for leaf in leaves]
    if len({*last}) < len(last) or all(map(units.known, last)):
        return []
    return [name_and_unit(text) for text in last]


def _is_weight(column: Column) -> bool:
    return column.unit is not None and units.is_weight(column.unit)


def _believed(column: Column, claims: dict[int, str], findings: list[Finding]) -> Column:
    """Return a column; without its unit, and without a claim, where its channel would be of no plausible size."""
    name = claims.get(id(column), "")
    if column.unit is None or name not in LARGEST:
        return column
    some = column.values[0 : series.SERIES_CHUNK]
    some = some[:: max(1, len(some) // SIZE_SAMPLES)]
    some = some[np.isfinite(some)]
    conversion = units.to_unit(column.unit, unit_of(name))
    size = conversion.scale * float(np.percentile(np.abs(some), 95.0)) if len(some) else 0.0
    lowest = conversion.scale * float(np.percentile(some, 5.0)) + conversion.offset if len(some) else 0.0
    too_cold = name == "temperature" and lowest < COLDEST
    if size <= LARGEST[name] and not too_cold:
        return column
    if name == "current" and column.name.isupper() and column.unit.startswith("M"):  # all is in capital letters
        small = f"m{column.unit[1:]}"
        text = f"'{column.name}' in '{column.unit}': taken as {small}; a channel map can say another"
        findings.append(Finding("unit-assumed", name, None, text))
        shouted = replace(column, unit=small)
        claims[id(shouted)] = claims.pop(id(column))
        return shouted
    reached = lowest if too_cold else size
    del claims[id(column)]
    text = (
        f"'{column.name}' in '{column.unit}' would reach {reached:.3g} {unit_of(name)}, which no {name} does: kept as "
        f"printed; write its true unit in a channel map"
    )
    findings.append(Finding("implausible-size", name, None, text))
    return replace(column, unit=None)


def pick(columns: list[Column], wanted: str | int | list[str], path: str, where: str) -> Column:
    """Return the column a map means: by header name, whatever its case, by name and unit, or by place from 0."""
    cells = wanted if isinstance(wanted, list) else [wanted]
    places = {place for one in cells for place in places_meant(one, columns)}
    found = [c for c in columns if c.index in places]
    if len(found) == 1:
        return found[0]
    there = ", ".join(f"{c.index} '{c.name}'" if c.name else str(c.index) for c in columns)
    what = f"no column {wanted!r}" if not found else f"{len(found)} columns named {wanted!r}"
    raise Refusal(path, f"{what} as the channel map asks (there are {there})", f"correct the column in {where}")


def _mapped(name: str, rule: ChannelRule, column: Column, path: str) -> Signal:
    written = rule.unit if rule.unit is not None else column.unit
    if rule.unit is None and rule.scale != 1.0:
        written = None  # a scale turns the file's unit into another one
    target = unit_of(name)
    if written is None and rule.scale == 1.0 and name in UNIT_NEEDED:
        raise Refusal(
            path,
            f"column '{column.name}' has no unit, and an acceleration may be in g or in {target}",
            f'write which in the channel map: [channels] {name} = {{column = "{column.name}", unit = "g"}}',
        )
    unit = written if written is not None else (target or "1")
    conversion = _conversion(name, unit, target, path)

    def converted(values: Array) -> Array:
        with np.errstate(over="ignore", invalid="ignore"):  # what overflows is refused row by row later
            return conversion.scale * (rule.sign * (rule.scale * values) + rule.offset) + conversion.offset

    return Signal(name, conversion.unit, series.mapped(converted, column.values), column.index)


def _conversion(name: str, unit: str, target: str, path: str) -> units.Conversion:
    if not units.known(unit):
        raise Refusal(
            path,
            f"column '{name}' has the unknown unit '{unit}'",
            f'write one in the channel map: [channels] {name} = {{column = …, unit = "{target or "V"}"}}, '
            f'or leave the column out: ignore = ["{name}"]',
        )
    if not target:
        return units.to_si(unit)
    if not units.compatible(unit, target):
        raise Refusal(path, f"{name} cannot be in '{unit}' (it needs a unit such as {target})", "correct the unit")
    return units.to_unit(unit, target)


def _is_known(column: Column) -> bool:
    return column.unit is None or units.known(column.unit)


def _unmapped(name: str, column: Column) -> Signal:
    if column.unit is None or not units.known(column.unit):
        return Signal(name, unit_of(name), column.values, column.index)
    target = unit_of(name)
    conversion = units.to_unit(column.unit, target) if target else units.to_si(column.unit)
    if conversion.unit == "degC" and not target and OF_DIFFERENCES & _words(column):
        conversion = units.Conversion("K", conversion.scale)

    def converted(values: Array) -> Array:
        with np.errstate(over="ignore", invalid="ignore"):
            return conversion.scale * values + conversion.offset

    plain = conversion.scale == 1.0 and conversion.offset == 0.0
    values = column.values if plain else series.mapped(converted, column.values)
    return Signal(name, conversion.unit, values, column.index)


def _is_in_two_units(columns: Sequence[Column], channel: str) -> bool:
    """Whether columns are one quantity in several units."""
    unit = unit_of(channel)
    if any(c.unit is None or not units.compatible(c.unit, unit) for c in columns) or len({c.unit for c in columns}) < 2:
        return False
    values = [units.to_unit(c.unit or unit, unit).scale * c.values[0:SIZE_SAMPLES] for c in columns]
    if not all(np.isfinite(v).any() for v in values):
        return False
    size = float(np.nanmax(np.abs(values[0])))
    return all(bool(np.nanmax(np.abs(v - values[0])) <= SAME_QUANTITY * size) for v in values[1:])


def _claims(columns: list[Column], taken: set[str], findings: list[Finding]) -> dict[int, str]:
    """Return id(column) -> canonical channel where exactly one column has the best claim to it.

    A unit alone is a claim only where no map has named anything.
    """
    by_unit = not taken
    ranked: dict[str, list[tuple[int, Column]]] = {}
    for column in columns:
        for strength, name in [] if _is_not_measured(column) else _candidates(column):
            if name not in taken and (by_unit or strength > 1):
                ranked.setdefault(name, []).append((strength, column))
    claims: dict[int, str] = {}
    for name, rivals in sorted(ranked.items(), key=lambda item: -max(s for s, _ in item[1])):
        rivals = [(s, c) for s, c in rivals if id(c) not in claims]
        best = [c for s, c in rivals if s == max(r for r, _ in rivals)]
        if len(best) > 1:
            same = _is_in_two_units(best, name)
            shown = " and ".join(f"'{c.name}' in {c.unit}" if same else f"'{c.name}'" for c in best)
            told = (
                f"are the same {name}: the first is taken as it, and no other"
                if same
                else f"may all be the {name}: name one in a channel map"
            )
            findings.append(Finding("twice" if same else "ambiguous-channel", name, None, f"{shown} {told}"))
            best = best[:1] if same else []
        if best:
            claims[id(best[0])] = name
            if best[0].unit is None:
                text = (
                    f"the file gives '{best[0].name}' no unit: taken as {unit_of(name)}; a channel map can say another"
                )
                findings.append(Finding("unit-assumed", name, None, text))
            findings += _rivals_said(best[0], name, rivals)
    if by_unit:
        _voltage_beside_current(columns, claims, taken)
        claimed = [(c, claims[id(c)]) for c in columns if id(c) in claims and _has_another_name(c)]
        if claimed:
            shown = ", ".join(f"'{c.name}' as the {name}" for c, name in claimed)
            findings.append(
                Finding("named-by-unit", "", None, f"{shown}, by the unit alone; a channel map can say another")
            )
        for column in filter(_is_not_measured, columns):
            wanted = [n for s, n in _candidates(column) if s > 1 or n in (*RIVALLED, "current")]
            if meant := [n for n in wanted if n not in claims.values()]:
                what = f"'{column.name}' is called what was asked for, a limit, an error, or a part of another quantity"
                text = f"{what}: it is not taken as {meant[0]}; a channel map can say otherwise"
                findings.append(Finding("not-measured", meant[0], None, text))
    return claims


def _rivals_said(chosen: Column, name: str, rivals: Sequence[tuple[int, Column]]) -> list[Finding]:
    """Return the finding on columns in the unit of a chosen one, called otherwise, that go with it but differ."""
    if name not in RIVALLED or not chosen.unit:
        return []
    others = [c for _, c in rivals if c is not chosen and c.unit and not _words(c) & (_words(chosen) | OF_TREATED)]
    told = [c for c in others if _goes_with(chosen, c, unit_of(name))]
    if not told:
        return []
    shown = " and ".join(f"'{c.name}'" for c in told)
    text = f"'{chosen.name}' is taken as the {name}; {shown} may be meant: a channel map can say so"
    return [Finding("ambiguous-channel", name, None, text)]


def _goes_with(one: Column, other: Column, unit: str) -> bool:
    """Whether two columns move together, and are not the same."""
    with np.errstate(over="ignore"):
        a, b = (units.to_unit(c.unit or unit, unit).scale * np.asarray(c.values[0:SIZE_SAMPLES]) for c in (one, other))
    both = (np.abs(a) < HUGE) & (np.abs(b) < HUGE)
    if np.count_nonzero(both) < FEWEST_TOGETHER:
        return False
    a, b = a[both] - np.mean(a[both]), b[both] - np.mean(b[both])
    size = float(np.sqrt(a @ a * (b @ b)))
    return size > 0.0 and abs(float(a @ b)) >= TOGETHER * size and bool(np.ptp(a - b) > SAME_QUANTITY * np.ptp(a))


def _candidates(column: Column) -> list[tuple[int, str]]:
    """Return (strength, channel) of what a column may be: 4 by name, 3 by a tester's, 2 by a word, 1 by unit."""
    exact = aliases_of(column.name)
    if column.unit is None:
        return [(3, n) for n in exact if len(column.name.strip()) > 1 and n not in ANGULAR]
    if not units.known(column.unit):
        return []
    possible = [n for n in units.channels_of(column.unit)]
    if named := [n for n in exact if n in possible]:
        return [(4, n) for n in named]
    if (own := _testers_channel(column)) in possible:
        return [(3, own)]
    spoken = _spoken(column, possible)
    if _is_no_coils(column):
        spoken, possible = ([n for n in among if n not in ("current", "voltage")] for among in (spoken, possible))
    if spoken or exact and len(column.name.strip()) > 2:
        return [(2, n) for n in spoken]
    # of channels in one unit the others are called by their names
    usual = [n for n in possible[:1] if n not in ANGULAR and n != "voltage"]
    return [(1, n) for n in usual if not units.is_weight(column.unit)]


def _testers_channel(column: Column) -> str:
    """Return the channel of a testing machine's own name; an empty text for other names."""
    return OF_TESTERS.get(" ".join(words_of(column.name)), "")


def _is_not_measured(column: Column) -> bool:
    """Whether a name is of what no model takes; a damper-side force is measured at the damper, a side force across."""
    words = _words_of_any_script(OF_SPECIMENS.sub("", column.name))
    compound = any(map(NOT_MEASURED_COMPOUND.match, words))
    return bool(NOT_MEASURED & words) or compound or re.match(r"side[ _]", column.name.strip().lower()) is not None


def _words(column: Column) -> set[str]:
    return set(re.split(r"[^a-zà-ÿ]+", " ".join(words_of(column.name))))


def _words_of_any_script(name: str) -> set[str]:
    """Return the words of a name; in a script without blanks every part of it may be one."""
    found = set(LETTERS.findall(" ".join(words_of(name))))
    solid = [w for w in found if w >= "\u2e80"]
    return found | {w[k : k + n] for w in solid for k in range(len(w)) for n in range(1, LONGEST_PART + 1)}


def _spoken(column: Column, among: Sequence[str]) -> list[str]:
    """Return the channels of which a column's name has a word."""
    words = _words(column)
    return [n for n in among if any(len(a) > 2 and a in words for a in (n, *CHANNELS[n].aliases))]


def _is_no_coils(column: Column) -> bool:
    """Whether amperes or volts are a sensor's: its name says so, or another quantity, or they stay in its loop."""
    named = _spoken(column, list(CHANNELS))
    name = OF_CURRENT_SENSORS.sub("", column.name)
    of_sensor = bool(_words_of_any_script(name) & OF_SENSORS) and not OF_COILS.search(name)
    if of_sensor or "4-20" in column.name or "4..20" in column.name:
        return True
    if named or column.unit is None or not units.compatible(column.unit, "A"):
        return bool(named) and not {"current", "voltage"} & set(named)
    ends = [units.to_unit(column.unit, "A").scale * e for e in series.extremes(column.values)]
    return LOOP[0] <= ends[0] < ends[1] <= LOOP[1]


def _voltage_beside_current(columns: list[Column], claims: dict[int, str], taken: set[str]) -> None:
    if "voltage" in taken | set(claims.values()) or "current" not in taken | set(claims.values()):
        return
    volts = [c for c in columns if c.unit is not None and id(c) not in claims and units.compatible(c.unit, "V")]
    if len(volts) == 1 and not aliases_of(volts[0].name) and not _is_no_coils(volts[0]):
        claims[id(volts[0])] = "voltage"


def _has_another_name(column: Column) -> bool:
    """Whether a column is called by words, of which none is that of a channel or of an input of a recorder."""
    words = {w for w in _words(column) if len(w) > 2} - OF_INPUTS
    return (
        bool(words)
        and not _testers_channel(column)
        and not _spoken(column, list(CHANNELS))
        and not aliases_of(column.name)
    )


def _own_name(column: Column, taken: set[str]) -> str:
    stem = re.sub(r"[^\w.-]+", "_", column.name.strip().lower()).strip("_") or f"column{column.index}"
    if stem in CHANNELS or stem == "time":
        stem = f"{stem}_{re.sub(r'[^a-z0-9]+', '', (column.unit or 'raw').lower()) or 'raw'}"
    name, number = stem, 2
    while name in taken:
        name, number = f"{stem}_{number}", number + 1
    return name


def check_wrong_dimension(columns: tuple[Column, ...], rules: Rules, path: str) -> None:
    """Refuse a column whose name says one quantity and whose unit another; a transducer's signal in V or mA passes."""
    named = mapped_places(rules, columns)
    for column in columns:
        words = aliases_of(column.name) if len(column.name.strip()) > 1 else []
        if not words or column.unit is None or column.index in named:
            continue
        if not units.known(column.unit) or units.compatible(column.unit, "V") or units.compatible(column.unit, "1"):
            continue
        if units.spelled(column.unit) == "mA" or units.compatible(column.unit, "rad/s"):
            continue
        others = [c for c in columns if c is not column and {*words} & {n for _, n in _candidates(c)}]
        if not others and not any(units.compatible(column.unit, unit_of(w)) for w in words):
            raise Refusal(
                path,
                f"column '{column.name}' is in '{column.unit}', which is no unit of {words[0]}",
                f"write the true one in the channel map: [channels] {words[0]} = "
                f'{{column = "{column.name}", unit = "{unit_of(words[0])}"}}',
            )


def all_missing(signal: Signal) -> bool:
    """Whether a signal holds no finite value at all."""
    return len(signal.values) > 0 and not series.count(np.isfinite, signal.values)
