from dataclasses import replace

import numpy as np
import pytest

from mrfit.errors import ConfigError
from mrfit.ingest.meaning.channel_map import ChannelRule, Rules
from mrfit.ingest.meaning.naming import called_by_leaf, check_wrong_dimension, name_signals
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Column


def _columns(*named: tuple[str, str | None]) -> tuple[Column, ...]:
    return tuple(Column(name, unit, np.arange(4.0) + k, k) for k, (name, unit) in enumerate(named))


def _names(*named: tuple[str, str | None], rules: Rules | None = None) -> list[tuple[str, str]]:
    signals, _ = name_signals(_columns(*named), rules or Rules(), "log.csv")
    return [(s.name, s.unit) for s in signals]


@pytest.mark.parametrize(
    ("header", "channels"),
    [
        ([("Force", "kN"), ("Stroke", "mm")], [("force", "N"), ("displacement", "m")]),
        ([("Lead Actuator Force", "kN"), ("Displacment", "mm")], [("force", "N"), ("displacement", "m")]),
        ([("i", "mA"), ("u", "V")], [("current", "A"), ("voltage", "V")]),
        ([("CH1", "V"), ("CH2", "A")], [("voltage", "V"), ("current", "A")]),
        ([("CH1", "V"), ("CH2", "V")], [("ch1", "V"), ("ch2", "V")]),
        ([("CH1", "V"), ("CH2", "V"), ("CH3", "A")], [("ch1", "V"), ("ch2", "V"), ("current", "A")]),
        ([("Force", "V"), ("Force", "N")], [("force_v", "V"), ("force", "N")]),
        ([("V", "cm/s"), ("F", "N")], [("velocity", "m/s"), ("force", "N")]),
        ([("current", None), ("flux", None)], [("current", "A"), ("flux", "Wb")]),
        ([("A", None), ("D", None), ("V", None)], [("a", ""), ("d", ""), ("v", "")]),
        ([("Load 1", "N"), ("Load 2", "N")], [("load_1", "N"), ("load_2", "N")]),
        ([("Oil temperature", "°F")], [("temperature", "degC")]),
        ([("p", "psi")], [("p", "Pa")]),
        ([("CH1", "V"), ("CH1", "V")], [("ch1", "V"), ("ch1_2", "V")]),
        ([("time", "V")], [("time_v", "V")]),
    ],
)
def test_names_and_units(header: list[tuple[str, str | None]], channels: list[tuple[str, str]]) -> None:
    assert _names(*header) == channels


@pytest.mark.parametrize(("factor", "kinds"), [(4.4482216152605, ["twice"]), (4.0, ["ambiguous-channel"])])
def test_one_quantity_in_two_units_is_taken_once(factor: float, kinds: list[str]) -> None:
    pounds, newtons = _columns(("Load", "lbf"), ("Load", "N"))
    newtons = replace(newtons, values=factor * np.asarray(pounds.values))
    signals, findings = name_signals([pounds, newtons], Rules(), "log.csv")
    assert [f.kind for f in findings] == kinds
    assert ("force" in {s.name for s in signals}) == (kinds == ["twice"])


def _wave(name: str, unit: str, factor: float, place: int = 0, phase: float = 0.0) -> Column:
    return Column(name, unit, factor * np.sin(np.arange(200) / 9 + phase), place)


@pytest.mark.parametrize(
    ("chosen", "other", "said"),
    [
        (_wave("Crosshead", "mm", 10.3), _wave("LVDT", "mm", 10.0), True),
        (_wave("Crosshead", "mm", 10.3), _wave("Disp. transducer", "in", -0.4), True),
        (_wave("Standard travel", "mm", 10.0), _wave("Crosshead absolute", "mm", 10.3), True),
        (_wave("Standardkraft", "N", 900.0), _wave("DMS", "N", 850.0), True),
        (_wave("Crosshead", "mm", 10.0), _wave("LVDT", "in", 10.0 / 25.4), False),  # the same
        (_wave("Displacement", "mm", 10.0), _wave("Displacement filtered", "mm", 9.9), False),
        (_wave("Displacement", "mm", 10.0), _wave("Pin", "mm", 1.0, phase=1.0), False),  # moves otherwise
        (_wave("Displacement", "mm", 10.0), _wave("Shim", "mm", 0.0), False),
        (_wave("Force", "N", 900.0), _wave("Friction", "N", 90.0), False),
        (_wave("Velocity", "mm/s", 900.0), _wave("Rod", "mm/s", 850.0), False),
    ],
)
def test_a_column_that_goes_with_the_chosen_one_is_said(chosen: Column, other: Column, said: bool) -> None:
    signals, findings = name_signals((chosen, replace(other, index=1)), Rules(), "log.csv")
    assert signals[0].name in ("displacement", "force", "velocity")
    text = "".join(f.text for f in findings if f.kind == "ambiguous-channel")
    assert text.startswith(f"'{chosen.name}' is taken as the {signals[0].name}; '{other.name}' may be meant") == said
    assert bool(text) == said


@pytest.mark.parametrize("other", ["nan", "inf", "1e308", "few"])
def test_a_column_with_too_few_numbers_goes_with_no_other(other: str) -> None:
    chosen, rival = _wave("Force", "N", 900.0), _wave("Reaction", "kN", 1.0, place=1)
    values = np.full(200, np.nan if other == "few" else float(other))
    values[:3] = rival.values[:3] if other == "few" else values[:3]
    _, findings = name_signals((chosen, replace(rival, values=values)), Rules(), "log.csv")
    assert not [f for f in findings if f.kind == "ambiguous-channel"]


def test_a_testers_name_in_another_unit_or_beside_the_usual_one_claims_nothing() -> None:
    assert [n for n, _ in _names(("Standardkraft", "MPa"), ("Standardweg", "%"))] == ["standardkraft", "standardweg"]
    assert [n for n, _ in _names(("Kraft", "N"), ("Standardkraft", "N"))] == ["force", "standardkraft"]


@pytest.mark.parametrize(("wanted", "found"), [("F (kN)", True), ("F (N)", False)])
def test_a_map_may_name_a_column_as_its_header_does(wanted: str, found: bool) -> None:
    rules = Rules(channels={"force": ChannelRule(column=wanted, unit="kN")})
    if not found:
        with pytest.raises(Refusal, match="no column"):
            _names(("F", "kN"), rules=rules)
    else:
        assert _names(("F", "kN"), rules=rules) == [("force", "N")]


def test_map_comes_first_and_scales() -> None:
    rules = Rules(
        channels={
            "flux": ChannelRule(column="ch2", unit="mWb", scale=2.0, offset=1.0, sign=-1),
            "current": ChannelRule(column=0, unit="A", scale=10.0),
        }
    )
    signals, _ = name_signals(_columns(("CH1", "V"), ("CH2", "V"), ("CH3", "V")), rules, "log.csv")
    values = {s.name: s.values for s in signals}
    np.testing.assert_allclose(values["current"], 10.0 * np.arange(4.0))
    np.testing.assert_allclose(values["flux"], 1e-3 * (-2.0 * (np.arange(4.0) + 1) + 1.0))
    assert [s.name for s in signals] == ["current", "flux", "ch3"]


def test_map_keeps_the_files_unit_and_else_takes_si() -> None:
    rules = Rules(channels={"force": ChannelRule(column=0), "displacement": ChannelRule(column=1)})
    signals, _ = name_signals(_columns(("a", "kN"), ("b", None)), rules, "log.csv")
    assert [(s.name, s.unit, s.values[1]) for s in signals] == [("force", "N", 1e3), ("displacement", "m", 2.0)]


@pytest.mark.parametrize("again", ["ch1", 0, ["A", "CH1"]])
def test_one_column_is_one_channel(again: str | int | list[str]) -> None:
    rules = Rules("mrfit.toml", channels={"current": ChannelRule(column="CH1"), "voltage": ChannelRule(column=again)})
    with pytest.raises(ConfigError, match=r"mrfit.toml: .*'channels.current' and 'channels.voltage' both name .*'CH1'"):
        name_signals(_columns(("CH1", None), ("CH2", None)), rules, "log.csv")


def test_ignored_columns_are_left_out() -> None:
    assert _names(("force", "N"), ("Spare", "blurbs"), rules=Rules(ignore=("spare",))) == [("force", "N")]


@pytest.mark.parametrize(
    ("rule", "message"),
    [
        (ChannelRule(column="CH9"), "no column 'CH9' as the channel map asks (there are 0 'CH1', 1 'CH2')"),
        (ChannelRule(column=7), "no column 7"),
        (ChannelRule(column="CH1", unit="mm"), "current cannot be in 'mm'"),
        (ChannelRule(column="CH1", unit="blurbs"), "unknown unit 'blurbs'"),
    ],
)
def test_maps_that_do_not_fit_are_refused(rule: ChannelRule, message: str) -> None:
    with pytest.raises(Refusal) as error:
        name_signals(_columns(("CH1", "V"), ("CH2", "V")), Rules("map.toml", channels={"current": rule}), "log.csv")
    assert message in str(error.value)


def test_a_column_of_unknown_unit_is_kept_as_printed_and_said() -> None:
    signals, findings = name_signals(_columns(("Load", "blurbs"), ("Coil", "mA")), Rules(), "log.csv")
    assert [(s.name, s.unit, s.values[1]) for s in signals] == [("load", "", 1.0), ("current", "A", 2e-3)]
    (said,) = [f for f in findings if f.kind == "unknown-unit"]
    assert "'Load' in 'blurbs': kept as printed; write the unit in a channel map" in said.text


def test_a_map_that_leaves_an_unknown_unit_to_the_file_makes_no_channel_of_it() -> None:
    rules = Rules("mrfit.toml", channels={"force": ChannelRule(column="Load"), "current": ChannelRule(column="Coil")})
    signals, findings = name_signals(_columns(("Load", "blurbs"), ("Coil", "mA")), rules, "log.csv")
    assert [s.name for s in signals] == ["load", "current"]
    assert [f.kind for f in findings] == ["unknown-unit"]


def test_wrong_dimension_is_refused_but_a_transducer_signal_is_not() -> None:
    check_wrong_dimension(_columns(("Force", "mV")), Rules(), "log.csv")
    with pytest.raises(Refusal, match="column 'Voltage' is in 'mm', which is no unit of voltage"):
        check_wrong_dimension(_columns(("Voltage", "mm")), Rules(), "log.csv")


def test_gauss_and_gravity_differ_in_case_only() -> None:
    signals, findings = name_signals(_columns(("a", "g"), ("B", "G")), Rules(), "log.csv")
    values = [(s.name, s.unit, float(s.values[0] + s.values[1]) / (1 + 2 * s.index)) for s in signals]
    assert values == [("acceleration", "m/s^2", 9.80665), ("flux_density", "T", pytest.approx(1e-4))]
    assert [f.kind for f in findings] == ["unit-assumed", "unit-assumed"]
    with pytest.raises(Refusal, match="column 'Acceleration' is in 'G', which is no unit of acceleration"):
        check_wrong_dimension(_columns(("Acceleration", "G")), Rules(), "log.csv")


def test_ambiguous_assumed_and_unnamed_columns_are_said() -> None:
    _, findings = name_signals(_columns(("Load 1", "N"), ("Load 2", "N"), ("flux", None), ("q", None)), Rules(), "a")
    assert {f.kind for f in findings} == {"ambiguous-channel", "unit-assumed", "unnamed"}


@pytest.mark.parametrize(
    ("header", "channels"),
    [
        ([("Position Error", "mm"), ("Force", "N")], ["position_error", "force"]),
        ([("Demand Position", "mm"), ("Position", "mm")], ["demand_position", "displacement"]),
        ([("Force Limit", "kN"), ("F_set", "N"), ("Axial force", "N")], ["force_limit", "f_set", "force"]),
        ([("ForceCommand", "N"), ("Max Load", "N")], ["forcecommand", "max_load"]),
        ([("Weg Soll", "mm"), ("Weg", "mm")], ["weg_soll", "displacement"]),
        ([("i_cmd", "A"), ("Coil current", "A")], ["i_cmd", "current"]),
        ([("Target", "mm"), ("Kraft", "N")], ["target", "force"]),
        ([("Actual position", "mm"), ("Load_Avg", "N")], ["displacement", "force"]),
        ([("Simulated force", "N"), ("Model Force", "N")], ["simulated_force", "model_force"]),
        ([("Delta force", "N"), ("Preload", "N")], ["delta_force", "preload"]),
        ([("ResetForce", "N")], ["force"]),  # no word of its own
        ([("Temperature rise", "K"), ("Oil temperature", "degC")], ["temperature_rise", "temperature"]),
        ([("Übertemperatur", "K"), ("Damper side force", "N")], ["übertemperatur", "force"]),
        ([("Current ripple", "A"), ("Force residual", "N")], ["current_ripple", "force_residual"]),
        ([("Side force", "N"), ("Lateral displacement", "mm")], ["side_force", "lateral_displacement"]),
        ([("Gap", "mm"), ("Querkraft", "N")], ["gap", "querkraft"]),
        ([("Spring force", "N"), ("Spool position", "mm")], ["spring_force", "spool_position"]),
        # of two channels in one unit only the first may be meant by a unit alone
        ([("F", "N"), ("F_filt", "N")], ["force", "f_filt"]),
        ([("F", "N"), ("Excitation force", "N")], ["force", "excitation_force"]),
    ],
)
def test_what_was_asked_for_is_not_what_was_measured(header: list[tuple[str, str]], channels: list[str]) -> None:
    assert [name for name, _ in _names(*header)] == channels


@pytest.mark.parametrize(
    ("names", "called"),
    [
        (["data.force_N", "data.stroke_mm"], [("force", "N"), ("stroke", "mm")]),
        (["Model Root/Sensors/Force[kN]/Out1", "Model Root/Coil/Current[A]/Out1"], [("Force", "kN"), ("Current", "A")]),
        (["f_N.signals.values", "disp.signals.values"], [("f", "N"), ("disp", None)]),
        # nothing is left to tell them apart, or what is left is their unit, or they are no paths
        (["one.force", "two.force"], [("one.force", None), ("two.force", None)]),
        (["Load.N", "Load.kN"], [("Load.N", None), ("Load.kN", None)]),
        (["Force.N", "Disp.mm"], [("Force.N", None), ("Disp.mm", None)]),
        (["Force..kN.", "Disp..mm."], [("Force..kN.", None), ("Disp..mm.", None)]),
        (["run.force"], [("run.force", None)]),
    ],
)
def test_columns_named_by_paths_are_called_by_what_differs(
    names: list[str], called: list[tuple[str, str | None]]
) -> None:
    columns = called_by_leaf(list(_columns(*((name, None) for name in names))))
    assert [(c.name, c.unit) for c in columns] == called


@pytest.mark.parametrize(
    ("name", "unit", "channel"),
    [
        ("Demand Position", "mm", "displacement"),
        ("Requested current", "A", "current"),
        ("Corrente impostata", "A", "current"),
        ("Sollstrom", "A", "current"),
        ("Prąd zadany", "A", "current"),
        ("Wegabweichung", "mm", "displacement"),
        ("Courant commandé", "A", "current"),
        ("Сила трения", "N", "force"),
        ("设定电流", "A", "current"),
        ("仿真力", "N", "force"),
        ("変位指令", "mm", "displacement"),
        ("최대하중", "N", "force"),
    ],
)
def test_a_demand_alone_is_said(name: str, unit: str, channel: str) -> None:
    signals, findings = name_signals(_columns((name, unit), ("Temp", "degC")), Rules(), "log.csv")
    assert [(f.kind, f.channel) for f in findings] == [("not-measured", channel)]
    assert channel not in {s.name for s in signals}


@pytest.mark.parametrize(
    ("name", "unit", "channel"),
    [
        ("阻尼器位移", "mm", "displacement"),
        ("电流传感器", "A", "current"),
        ("模拟输入电流", "A", "current"),
        ("ばね上加速度", "m/s^2", "acceleration"),
        ("Сила тока катушки", "A", "current"),
        ("Усилие на штоке", "N", "force"),
        ("Corrente bobina", "A", "current"),
        ("Iststrom", "A", "current"),
        ("Solenoid current", "A", "current"),
        ("Sollicitation", "N", "force"),
        ("Course du piston", "mm", "displacement"),
        ("출력 전류", "A", "current"),
        ("力（最大10kN）", "N", "force"),
        ("Force (max 10 kN)", "N", "force"),
        ("摩擦阻尼器力", "N", "force"),
        ("音圈电机电流", "A", "current"),
        ("Courant de commande", "A", "current"),
        ("Standardkraft", "N", "force"),
    ],
)
def test_words_of_other_languages_for_what_was_measured(name: str, unit: str, channel: str) -> None:
    assert [n for n, _ in _names((name, unit), ("Temp", "degC"))] == [channel, "temperature"]


@pytest.mark.parametrize(
    ("header", "channels"),
    [
        ([("Force", "mA"), ("CH2", "A")], ["force_ma", "current"]),
        ([("Load cell", "mA"), ("Coil current", "A")], ["load_cell", "current"]),
        ([("Pressure sensor", "mA")], ["pressure_sensor"]),
        ([("Loop current", "mA"), ("Coil current", "mA")], ["loop_current", "current"]),
        ([("LVDT", "V"), ("Current", "A")], ["lvdt", "current"]),
        ([("AI3", "mA")], ["current"]),  # from 0 to 3 mA
        ([("Motor current", "A"), ("Trigger", "V")], ["motor_current", "trigger"]),
        ([("Current", "A"), ("Battery", "V")], ["current", "battery"]),
        ([("Battery current", "A"), ("Supply voltage", "V")], ["battery_current", "supply_voltage"]),
        ([("Cooling air velocity", "m/s"), ("Velocity", "mm/s")], ["cooling_air_velocity", "velocity"]),
        ([("Load current", "mA")], ["current"]),
        ([("电机电流", "A"), ("线圈电流", "A")], ["电机电流", "current"]),
        ([("モータ電流", "A"), ("Corrente motore", "A"), ("전류", "A")], ["モータ電流", "corrente_motore", "current"]),
        ([("位移传感器电压", "V"), ("电流", "A")], ["位移传感器电压", "current"]),
    ],
)
def test_amperes_of_a_sensor_are_no_coils(header: list[tuple[str, str]], channels: list[str]) -> None:
    assert [name for name, _ in _names(*header)] == channels
    check_wrong_dimension(_columns(*header), Rules(), "log.csv")


@pytest.mark.parametrize(("low", "high", "name"), [(4.0, 20.0, "ai3"), (3.9, 12.0, "ai3"), (0.0, 20.0, "current")])
def test_a_channel_that_stays_in_the_loop_of_sensors(low: float, high: float, name: str) -> None:
    columns = (Column("AI3", "mA", np.linspace(low, high, 50), 0),)
    assert [s.name for s in name_signals(columns, Rules(), "log.csv")[0]] == [name]


@pytest.mark.parametrize(
    ("name", "unit", "value", "channel"),
    [
        ("Displacement", "Mm", 10.0, "displacement_raw"),
        ("Coil current", "MA", 2.0, "coil_current"),
        ("Stroke", "km", 1.0, "stroke"),
        ("Force", "GN", 1.0, "force_raw"),
        ("Voltage", "MV", 24.0, "voltage_raw"),
        ("Displacement", "mm", 10.0, "displacement"),
        ("Force", "MN", 8.0, "force"),  # a damper of a bridge
        ("Current", "kA", 3.0, "current"),
    ],
)
def test_a_size_that_no_damper_has_is_not_believed(name: str, unit: str, value: float, channel: str) -> None:
    columns = (Column(name, unit, value * np.cos(np.arange(200) / 9), 0),)
    (signal,), findings = name_signals(columns, Rules(), "log.csv")
    assert signal.name == channel
    believed = signal.unit != ""
    assert [f.kind for f in findings] == ([] if believed else ["implausible-size"])
    if not believed:
        assert np.max(signal.values) == pytest.approx(value)
        rules = Rules(channels={"force" if "Force" in name else "displacement": ChannelRule(column=name, unit="N")})
        if "Force" in name:  # whoever says the unit is believed
            assert name_signals(columns, rules, "log.csv")[0][0].name == "force"


@pytest.mark.parametrize(
    ("name", "unit", "value", "channel"),
    [
        ("Temperature", "K", 298.0, "temperature"),
        ("Temperature", "K", 25.0, "temperature_raw"),
        ("Temperature", "°F", -100.0, "temperature"),
        ("Temperature", "degC", -130.0, "temperature_raw"),
    ],
)
def test_a_cold_that_no_damper_has_is_not_believed(name: str, unit: str, value: float, channel: str) -> None:
    column = replace(_columns((name, unit))[0], values=np.full(100, value))
    assert [s.name for s in name_signals((column,), Rules(), "log.csv")[0]] == [channel]


@pytest.mark.parametrize(("unit", "kelvin"), [("K", 6.0), ("degC", 6.0), ("°F", 6.0 / 1.8)])
def test_a_difference_of_temperatures_has_no_zero(unit: str, kelvin: float) -> None:
    column = replace(_columns(("Temperature rise", unit))[0], values=np.full(100, 6.0))
    (signal,) = name_signals((column,), Rules(), "log.csv")[0]
    assert signal.unit == "K" and signal.values[:] == pytest.approx(kelvin)


def test_a_map_makes_no_temperature_of_a_difference() -> None:
    rules = Rules(channels={"temperature": ChannelRule(column="Rise", unit="delta_degC")})
    with pytest.raises(Refusal, match="temperature cannot be in 'delta_degC'"):
        name_signals(_columns(("Rise", None)), rules, "log.csv")


def test_a_garbled_number_is_no_reason_to_doubt_a_unit() -> None:
    values = np.cos(np.arange(200) / 9)
    values[[3, 4]] = 1e12
    (signal,), _ = name_signals((Column("Force", "kN", values, 0),), Rules(), "log.csv")
    assert signal.name == "force"


@pytest.mark.parametrize(
    ("name", "unit", "newtons"),
    [
        ("Force", "lb", 4.4482216),
        ("Axial Load 1", "lb", 4.4482216),
        ("Load", "kg", 9.80665),
        ("Force", "klb", 4448.2216),
        ("Load", "LBS", 4.4482216),
        ("LoadCell force", "pounds", 4.4482216),
    ],
)
def test_pounds_and_kilograms_of_a_force(name: str, unit: str, newtons: float) -> None:
    columns = _columns((name, unit))
    check_wrong_dimension(columns, Rules(), "log.csv")
    (signal,), findings = name_signals(columns, Rules(), "log.csv")
    assert (signal.name, signal.unit) == ("force", "N")
    assert signal.values[1] == pytest.approx(newtons, rel=1e-7)
    assert [f.kind for f in findings] == (["unit-assumed"] if unit != "LBS" else [])


def test_pounds_of_a_mass_stay_a_mass() -> None:
    assert _names(("Mass", "lb"), ("Sample", "kg")) == [("mass", "kg"), ("sample", "kg")]


def test_a_map_may_say_pounds() -> None:
    rules = Rules(
        channels={"force": ChannelRule(column="CH1", unit="lb"), "torque": ChannelRule(column=1, unit="ft-lb")}
    )
    signals, _ = name_signals(_columns(("CH1", None), ("CH2", None)), rules, "log.csv")
    assert [float(s.values[1]) for s in signals] == [pytest.approx(4.4482216), pytest.approx(2 * 1.3558179)]


def test_a_base_acceleration_without_a_unit_is_refused_and_one_in_g_is_read() -> None:
    rules = Rules(channels={"base_acceleration": ChannelRule(column="acc")})
    with pytest.raises(Refusal, match=r"'acc' has no unit, and an acceleration may be in g or in m/s\^2; write which"):
        name_signals(_columns(("acc", None)), rules, "log.csv")
    in_g = Rules(channels={"base_acceleration": ChannelRule(column="acc", unit="g")})
    (signal,), _ = name_signals(_columns(("acc", None)), in_g, "log.csv")
    assert np.asarray(signal.values[0:4]) == pytest.approx(9.80665 * np.arange(4.0))


def test_a_channel_that_another_word_names_is_said_to_be_known_by_its_unit() -> None:
    signals, findings = name_signals(
        _columns(("Plunger", "mm"), ("Force", "N"), ("AI 3", "A"), ("Drive", "V")), Rules(), "log.csv"
    )
    assert [s.name for s in signals] == ["displacement", "force", "current", "voltage"]
    (said,) = (f.text for f in findings if f.kind == "named-by-unit")
    assert said.startswith("'Plunger' as the displacement, 'Drive' as the voltage, by the unit alone")


def test_a_speed_of_a_motor_is_no_velocity_and_refuses_nothing() -> None:
    columns = _columns(("Speed", "rpm"), ("Force", "N"))
    check_wrong_dimension(columns, Rules(), "log.csv")
    assert [s.name for s in name_signals(columns, Rules(), "log.csv")[0]] == ["speed", "force"]


@pytest.mark.parametrize(("name", "channel"), [("CURRENT", "current"), ("Current", "current_raw")])
def test_a_capital_m_is_milli_where_all_letters_are_capitals_and_nothing_else_can_be(name: str, channel: str) -> None:
    (signal,), findings = name_signals((Column(name, "MA", np.linspace(500.0, 1100.0, 50), 0),), Rules(), "log.csv")
    assert (signal.name, len(findings)) == (channel, 1)
    assert channel == "current_raw" or signal.values[0] == pytest.approx(0.5)


def test_a_name_with_another_quantitys_unit_is_refused_only_where_no_other_column_is_the_channel() -> None:
    odd, good = Column("Load", "ohm", np.ones(9), 0), Column("Force", "N", np.ones(9), 1)
    check_wrong_dimension((odd, good), Rules(), "log.csv")
    with pytest.raises(Refusal, match="no unit of force"):
        check_wrong_dimension((odd,), Rules(), "log.csv")
