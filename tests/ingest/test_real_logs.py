"""Real instrument files: channels, units, rows, rate, first and last values as a look at the bytes gives them.

The numbers below were taken from the files with a text editor, ``wc`` and ``str.split``, not with mrfit.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from mrfit.ingest.dispatch import claims
from mrfit.ingest.head import open_head
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.stage import Settings, examine
from mrfit.recording import Recording

PRESS = """
time = 0
pattern = "{amplitude:mm}mm{frequency:Hz}Hz{current:A}A"
[channels]
displacement = {column = 1, unit = "mm"}
velocity = {column = 2, unit = "mm/s"}
force = {column = 3, unit = "N"}
"""
LOOP = """
[channels]
current = {column = "CH1", scale = 10.0, unit = "A"}
flux = {column = "CH2", scale = 0.01, unit = "Wb"}
"""
RAW_PRESS = """
[channels]
force = {column = "CHANNEL0", scale = 980.665, unit = "N"}
displacement = {column = "CHANNEL1", scale = 10.0, offset = 29.9, unit = "mm"}
[condition]
current = [0.0, 0.25, 0.5, 0.75, 1.0]
[[files]]
match = "ME5mm*"
[files.channels]
force = {column = "CHANNEL1", scale = 980.665, unit = "N"}
displacement = {column = "CHANNEL0", scale = 10.0, offset = 29.9, unit = "mm"}
"""
TABLE = """
[channels]
displacement = {column = "x_F[0]", unit = "mm"}
velocity = {column = "x_F[1]", unit = "mm/s"}
force = {column = "x_F[2]", unit = "N"}
"""
DYKE = """
[channels]
acceleration = {column = "A", unit = "cm/s^2"}
displacement = {column = "D", unit = "cm"}
velocity = {column = "V", unit = "cm/s"}
force = {column = "F", unit = "N"}
voltage = {column = "Y", unit = "V"}
"""
SPENCER = """
rate = 500
[channels]
displacement = {column = "x", unit = "cm"}
velocity = {column = "v", unit = "cm/s"}
acceleration = {column = "a", unit = "cm/s^2"}
voltage = {column = "E", unit = "V"}
force = {column = "f", unit = "N"}
"""
KEIO = """
dt = 0.005
[channels]
velocity = {column = ["U", "U_val"], unit = "cm/s"}
force = {column = ["Y", "Y_val"], unit = "N"}
"""
WIENER = 'rate = 51200\n[channels]\nvoltage = {column = ["U", "U_val"], unit = "V"}\n'
WIRE = 'rate = 20e6\n[channels]\nvoltage = {column = 0, unit = "V"}\ncurrent = {column = 1, unit = "A"}\n'
BARE = 'rate = 40e9\n[channels]\nvoltage = {column = 1, unit = "V"}\nch1 = {column = 0, unit = "V"}\n'
TIMED = 'time = 0\n[channels]\nvoltage = {column = 1, unit = "V"}\n'
EARTHQUAKE = 'time = 0\n[channels]\nacceleration = {column = 1, unit = "m/s^2"}\n'
WALL = "rate = 1\n"
SLIT = 'rate = 1\n[channels]\ndisplacement = {column = 0, unit = "mm"}\nforce = {column = 1, unit = "kN"}\n'
APPROX = 'rate = 1\n[channels]\ncurrent = {column = 0, unit = "A"}\nflux = {column = 1, unit = "Wb"}\n'
mm, cm, kN, kgf = 1e-3, 1e-2, 1e3, 9.80665

Ends = tuple[str, float, float]


@dataclass(frozen=True)
class Truth:
    """What a file holds: reader, rows kept and refused, rate in Hz, start in s; channel -> unit, first, last."""

    file: str
    reader: str
    rows: int
    rate: float
    start: float
    channels: dict[str, Ends]
    refused: int = 0
    map: str = ""
    piece: int = 0
    pieces: int = 1
    samples: int = 0


def _press(stem: str, rows: int, rate: float, first: tuple[float, ...], last: tuple[float, ...]) -> Truth:
    units = ("m", "m/s", "N")
    scales = (mm, mm, 1.0)
    names = ("displacement", "velocity", "force")
    ends = {n: (u, a * s, b * s) for n, u, s, a, b in zip(names, units, scales, first, last, strict=True)}
    return Truth(f"mr_damper_utfsm/preprocessed/{stem}.txt", "delimited", rows, rate, 0.0, ends, map=PRESS)


def _rig(stem: str, rows: int, rate: float, first: tuple[float, ...], last: tuple[float, ...]) -> Truth:
    scales = {"displacement": mm, "velocity": mm, "force": 1.0}
    units = {"displacement": "m", "velocity": "m/s", "force": "N"}
    ends = {n: (units[n], a * s, b * s) for (n, s), a, b in zip(scales.items(), first, last, strict=True)}
    return Truth(f"mr_damper_labcontrol/{stem}.mat", "matlab", rows, rate, 0.0, ends, map=TABLE)


def _volts(**ends: tuple[float, float]) -> dict[str, Ends]:
    return {name: ("V", *pair) for name, pair in ends.items()}


TRUTHS = [
    Truth("keysight/scope_0.csv", "keysight", 2000, 4000, -0.25,
          _volts(ch1=(0.1586506, 0.6348013), ch2=(0.0021182, 0.0046287), ch4=(-8.5355648, 6.5271966))),
    Truth("keysight/scope_3.csv", "keysight", 64252, 1 / 7.00007777e-06, -0.037268997,
          _volts(ch1=(-7.275191752, -7.027196631), ch2=(-0.321163516, -0.320400073)), refused=33),
    Truth("siglent/SDS00001.csv", "siglent", 700, 1e9, -3.5e-7, _volts(ch1=(-15.136, 16.192))),
    Truth("siglent/SDS00005.CSV", "siglent", 700, 1e9, -3.5e-7, _volts(ch1=(-11.16, 11.52))),
    Truth("lecroy/WR6051_30_C1Trace00000.txt", "lecroy", 100002, 1e7, -0.0050000174,
          _volts(ch1=(-0.123745, -0.229812))),
    Truth("picoscope/Hysterese.csv", "picoscope", 7817, 390625, -0.01000444498,
          _volts(channel_a=(0.00012207, 0.00012207), channel_b=(2.039552, 2.084719))),
    Truth("picoscope/PicoScopeData.txt", "picoscope", 50, 1 / 2.62143998e-3, -0.05295434967,
          _volts(kanal_a=(2.986236, -2.670217), kanal_b=(0.4915921, -0.4220099))),
    Truth("digilent/acq0001.csv", "digilent", 8192, 160e3, -0.04194693827633146,
          _volts(channel_1=(0.9970483195573782, 0.9970483195573782),
                 channel_2=(0.9856015688999449, 0.9862824495941154))),
    Truth("gwinstek/DS0001.CSV", "gwinstek", 25000, 4e9, -3.245e-6, _volts(ch1=(-0.038, -0.016))),
    Truth("leybold_cassy/Cassy.txt", "leybold-cassy", 6609, 6608 / 660.83706, 0.0,
          {"displacement": ("m", -0.131, 0.03), "winkel": ("rad", -1.42546245919478, 0.326441784548422),
           "voltage": ("V", 2.58, 2.165), "u_k": ("V", 0.0100000000000002, -0.405)}),
    Truth("tektronix/MSO2014_T0000.CSV", "tektronix-mso", 125000, 625e3, -0.1, _volts(ch1=(-0.08, 0.04))),
    Truth("tektronix/MSO3012_tek0000.csv", "tektronix-mso", 10000, 25e6, -2e-4,
          _volts(ch1=(-0.00190625, -0.00246094), ch2=(0.00609375, 0.0184375))),
    Truth("tektronix/TDS2024B_ALL0004", "tektronix-tds", 2500, 100e3, -0.0068,
          _volts(ch1=(0.504, 0.632), ch2=(0.432, 0.664), ch3=(1.68, -0.48), ch4=(-0.036, 0.018))),
    *(Truth(f"tektronix/TDS2024B_ALL0004/F0004CH{k}.CSV", "tektronix-tds", 2500, 100e3, -0.0068,
            _volts(**{f"ch{k}": ends}))
      for k, ends in ((1, (0.504, 0.632)), (2, (0.432, 0.664)), (3, (1.68, -0.48)), (4, (-0.036, 0.018)))),
    Truth("rigol/DS1052E.csv", "rigol", 8192, 500e6, 0.0, _volts(ch1=(1.72, -0.04), ch2=(9.92, 4.96)), refused=1),
    Truth("rigol/DS1054Z-A.csv", "rigol", 1200, 2e9, -3e-7,
          _volts(ch1=(3.28, 4.08), ch2=(0.96, 1.12), ch3=(-0.16, 3.36), ch4=(0.0, -0.2))),
    Truth("rigol/DS1074Z-A.csv", "rigol", 1200, 50e3, -2e-3,
          _volts(ch1=(0.0, 0.058), ch2=(-1.0, -0.06), ch3=(0.0, -0.048))),
    Truth("rigol/DS2072A-6.csv", "rigol", 1400, 200e3, -3.5e-3, _volts(ch1=(0.016, 0.32))),
    Truth("rigol/DS4024-A.csv", "rigol", 1356, 500e3, -1.4e-3 + 22 * 2e-6,
          _volts(ch1=(0.03125, 3.0), ch2=(0.00625, 0.0125))),
    Truth("rigol/DS1102E-D.csv", "rigol", 600, 500e3, -5.9999997e-4, _volts(ch1=(-1.28, -1.36), ch2=(5.4, 5.4))),
    Truth("rigol/DS1204B-F.csv", "rigol", 8192, 250e3, -0.016384, _volts(ch2=(14.8, 20.8), ch4=(14.4, 13.6))),
    Truth("rigol_bh_loop/histerese_osciloscopio_80.csv", "rigol", 1200, 10e3, -0.0668,
          {"current": ("A", 1.22, -1.91), "flux": ("Wb", 0.00378, -0.00168)}, map=LOOP),
    Truth("rigol_bh_loop/histerese_approx_80.csv", "delimited", 184, 1, 0.0,
          {"current": ("A", -0.20967032967032978, -0.21520879120879133),
           "flux": ("Wb", -0.46447368421052626, -0.4710526315789473)}, map=APPROX),
    Truth("rigol_bh_2col/50kHz.csv", "delimited", 1200, 20e6, 0.0,
          {"voltage": ("V", -0.21, -0.20), "current": ("A", 2.0, 1.2)}, map=WIRE),
    Truth("rohde_schwarz/rs_rtp_02.Wfm.csv", "delimited", 4000, 40e9, 0.0,
          _volts(ch1=(-0.031620555, 1.027668), voltage=(-0.22134387, 0.0)), map=BARE),
    Truth("rohde_schwarz/rs_rtp_04.Wfm.csv", "delimited", 4000, 40e9, -5.24e-8,
          _volts(voltage=(-0.000286438, -1.47e-05)), map=TIMED),
    Truth("mr_damper_labcontrol/elcentro.dat", "delimited", 2688, 50, 0.0,
          {"acceleration": ("m/s^2", -1.4275799e-3, -1.4275799e-3)}, map=EARTHQUAKE),
    Truth("seismic_damper_cyclic/SPC1.csv", "delimited", 33028, 1, 0.0,
          {"force": ("N", 0.02 * kN, 4.44 * kN), "displacement": ("m", 0.0, 3.8 * mm)}, map=WALL),
    Truth("seismic_damper_cyclic/Damper - Chan and Albermani.csv", "delimited", 200, 1, 0.0,
          {"displacement": ("m", -0.099304866 * mm, -18.60966231 * mm),
           "force": ("N", -0.157618214 * kN, -0.262697023 * kN)}, map=SLIT),
    Truth("mr_damper_nees_dyke/ranran_50_converted.csv", "delimited", 74068, 3004.8, 0.0,
          {"acceleration": ("m/s^2", -32.3798 * cm, -2.8907 * cm),
           "displacement": ("m", 0.021147 * cm, -0.0080672 * cm), "voltage": ("V", 2.2551, 0.010834),
           "velocity": ("m/s", 7.8095 * cm, 0.24937 * cm), "force": ("N", 946.961, -88.5717)}, map=DYKE),
    Truth("benchmark_spencer_mr_synthetic/boucwen_histeretic_system.csv", "delimited", 4000, 500, 0.0,
          {"displacement": ("m", 0.0, 0.0806174730721144 * cm), "force": ("N", 0.0, -792.5284011265438),
           "voltage": ("V", 1.125, 1.0332256437717233)}, map=SPENCER),
    Truth("mr_damper_sano_keio/Magneto.mat", "matlab", 2000, 200, 0.0, {}, map=KEIO, pieces=2),
    Truth("mr_damper_sano_keio/Magneto.mat", "matlab", 1499, 200, 0.0, {}, map=KEIO, piece=1, pieces=2),
    Truth("benchmark_wiener_hammerstein/wh.mat", "matlab", 99999, 51200, 0.0, {}, map=WIENER, pieces=2),
    Truth("damper_dyno_python_daq/t1_1_1_18_18_s5_n10_150psi.csv", "delimited", 3150, 300, 0.0,
          {"force": ("N", 18.494916091026347, 43.747203812959405),
           "force_v": ("V", 0.09322974136014894, 0.22052224928399740),
           "displacement": ("m", 49.31088863680873 * mm, 41.207770121206075 * mm),
           "displacement_v": ("V", 5.115237410457336, 4.27466495033258),
           "temperature": ("degC", 25.776273805895222, 25.776273805895222),
           "temperature_v": ("V", 1.0155254761179044, 1.0155254761179044)}),
    Truth("damper_dyno_python_daq/t1_2_2_18_18_s5_n10_50psi.csv", "delimited", 3150, 300, 0.0,
          {"force": ("N", 32.817595471955414, 13.764190892994648),
           "temperature": ("degC", 22.881762513633433, 23.317583791134396)}),
    Truth("damper_dyno_python_daq/t1_2_2_24_24_s5_n10_100psi.csv", "delimited", 3150, 300, 0.0,
          {"force": ("N", -61.626087602868765, -13.829442273919403),
           "displacement": ("m", 16.00762087420678 * mm, 20.174069695158874 * mm)}),
    Truth("mts_mpt_cyclic_es/sampledatafiletype1.dat", "mts-mpt", 51, 512, 10.016357,
          {"displacement": ("m", -0.095496617 * mm, -0.095166318 * mm),
           "force": ("N", -4.1995568 * kgf, -4.2503896 * kgf), "channel_1_recuento": ("1", 99.0, 99.5)}, pieces=10),
    Truth("mts_mpt_cyclic_es/sampledatafiletype1.dat", "mts-mpt", 51, 512, 100.01636,
          {"force": ("N", -6.8788729 * kgf, -7.3198833 * kgf)}, piece=9, pieces=10),
    Truth("mts_testsuite/I8-3-1-dc", "mts-testsuite", 7581, 100, 16.6609992980957,
          {"displacement": ("m", -1.69551419094205 * mm, np.nan),
           "force": ("N", 0.000294344295980409, np.nan)}, samples=7584),
    Truth("labview_lvm/multi_time_column.lvm", "labview-lvm", 3, 51200, 0.0,
          {"voltage": ("V", -0.035229, -0.034191), "acceleration": ("m/s^2", 0.532608 * kgf, 0.467541 * kgf)}),
    Truth("labview_lvm/with_comments.lvm", "labview-lvm", 9, 0.0, 0.0,
          {"temperature": ("degC", 5.479238, np.nan), "volume": ("m^3", 0.0, np.nan)}, samples=13),
    Truth("labview_lvm/long_single_header_multi_ch.lvm", "labview-lvm", 16384, 1 / 0.000977, 0.0,
          {"m_1": ("m/s^2", 0.234571, 0.235689), "m_2": ("m/s^2", 0.244440, 0.263686)}),
    *(Truth("mr_damper_utfsm/raw/ME2mm5Hz.txt", "daq-text", rows, 200, start,
            {"force": ("N", a * 980.665, b * 980.665), "displacement": ("m", c * cm + 29.9 * mm, d * cm + 29.9 * mm)},
            map=RAW_PRESS, piece=k, pieces=5)
      for k, (rows, start, a, b, c, d) in enumerate((
          (1860, 0.0, 0.0259, 0.0626, -2.9931, -2.9931), (1200, 39.683, 0.0381, 0.0656, -2.9931, -2.9931),
          (1120, 73.552, 0.0351, 0.0870, -2.9931, -2.9931), (1260, 96.490, 0.0809, 0.1083, -2.9931, -2.9928),
          (1980, 118.190, 0.1022, 0.0778, -2.9928, -2.9931)))),
    *(Truth("mr_damper_utfsm/raw/ME5mm4Hz.txt", "daq-text", rows, 1000, start,
            {"force": ("N", a * 980.665, b * 980.665), "displacement": ("m", c * cm + 29.9 * mm, d * cm + 29.9 * mm)},
            map=RAW_PRESS, piece=k, pieces=5)
      for k, (rows, start, a, b, c, d) in enumerate((
          (6700, 0.0, 0.0107, 0.0656, -2.9928, -2.9921), (6200, 23.417, 0.0412, 0.0595, -2.9928, -2.9924),
          (5900, 43.104, 0.0473, 0.1266, -2.9924, -2.9924), (6100, 61.890, 0.0412, 0.0992, -2.9924, -2.9924),
          (6400, 80.308, 0.0351, 0.0992, -2.9928, -2.9924)))),
]  # fmt: skip

REFUSED = [
    ("rigol_bh_2col/50kHz.csv", "first row, line 1: '-0.21,2.00E+00'", "channel map"),
    ("rigol_bh_loop/histerese_approx_80.csv", "no header says what its 2 columns are", "channel map"),
    ("rohde_schwarz/rs_rtp_02.Wfm.csv", "no header says what its 2 columns are", "channel map"),
    ("rohde_schwarz/rs_rtp_04.Wfm.csv", "column 0 rises evenly and may be the time", "channel map"),
    ("mr_damper_labcontrol/elcentro.dat", "column 0 rises evenly and may be the time", "channel map"),
    ("mr_damper_utfsm/preprocessed/2mm5Hz0A.txt", "no header says what its 4 columns are", "channel map"),
    ("seismic_damper_cyclic/Damper - Chan and Albermani.csv", "no header", "channel map"),
    ("seismic_damper_cyclic/SPC1.csv", "no time column and no sample rate", "rate = HZ"),
    ("benchmark_spencer_mr_synthetic/boucwen_histeretic_system.csv", "no time column and no sample rate", "rate = HZ"),
    ("mr_damper_sano_keio/Magneto.mat", "no time column and no sample rate (columns: 'U', 'Y')", "rate = HZ"),
    ("benchmark_wiener_hammerstein/wh.mat", "no time column and no sample rate", "rate = HZ"),
    ("mr_damper_utfsm/ajuste2_parametros.mat", "no time column and no sample rate", "rate = HZ"),
    ("mr_damper_labcontrol/Ensaios.ods", "a ZIP, XLSX or ODS file", "export the sheet as CSV"),
    ("tektronix/TDS2024B_ALL0004/F0004TEK.SET", "no row of numbers (it begins ':DISPLAY:FORMAT YT", "export the log"),
    ("mts_testsuite/I0-0.9-dc_empty", "a byte-order mark and nothing else (3 bytes)", "copy it"),
]


def _read(real_logs: Path, tmp_path: Path, file: str, channel_map: str) -> tuple[list[Recording], list[Refusal]]:
    path = None
    if channel_map:
        path = tmp_path / "map.toml"
        path.write_text(channel_map)
    return examine([real_logs / file], Settings(map=path))


@pytest.mark.parametrize("truth", TRUTHS, ids=lambda t: f"{t.file}#{t.piece}")
def test_log_is_read_as_it_is(truth: Truth, real_logs: Path, tmp_path: Path) -> None:
    recordings, _ = _read(real_logs, tmp_path, truth.file, truth.map)
    assert len(recordings) == truth.pieces
    record = recordings[truth.piece]
    assert record.reader == truth.reader
    assert (record.rows_kept, record.rows_refused) == (truth.rows, truth.refused)
    assert record.samples == (truth.samples or truth.rows)
    assert record.start == pytest.approx(truth.start, abs=1e-12 + 1e-9 * abs(truth.start))
    if truth.rate:
        assert 1.0 / record.dt == pytest.approx(truth.rate, rel=5e-6)
    assert set(truth.channels) <= set(record.channels)
    for name, (unit, first, last) in truth.channels.items():
        assert record.units[name] == unit
        assert record.channels[name][0] == pytest.approx(first, rel=1e-9, abs=1e-15)
        if not np.isnan(last):
            assert record.channels[name][-1] == pytest.approx(last, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize(("file", "reason", "remedy"), REFUSED, ids=[r[0] for r in REFUSED])
def test_log_is_refused_with_its_remedy(file: str, reason: str, remedy: str, real_logs: Path, tmp_path: Path) -> None:
    recordings, refusals = _read(real_logs, tmp_path, file, "")
    assert not recordings
    assert len(refusals) == 1
    assert reason in refusals[0].reason
    assert remedy in refusals[0].remedy


def test_preprocessed_press_logs(real_logs: Path, tmp_path: Path) -> None:
    """Every file against numpy.loadtxt, with its conditions in SI and the untrue amplitude said."""
    recordings, refusals = _read(real_logs, tmp_path, "mr_damper_utfsm/preprocessed", PRESS)
    assert not refusals and len(recordings) == 10
    for record in recordings:
        table = np.loadtxt(record.source)
        assert record.rows_kept == len(table)
        assert record.dt == pytest.approx(table[1, 0] - table[0, 0], rel=1e-9)
        np.testing.assert_allclose(record.channels["displacement"], table[:, 1] * mm, rtol=1e-12)
        np.testing.assert_allclose(record.channels["velocity"], table[:, 2] * mm, rtol=1e-12)
        np.testing.assert_allclose(record.channels["force"], table[:, 3], rtol=1e-12)
        stem = Path(record.source).stem.replace("x", ".").removesuffix("A")
        stroke, rest = stem.split("mm")
        frequency, current = rest.split("Hz")
        assert record.condition["amplitude"] == pytest.approx(float(stroke) * mm)
        assert record.condition["frequency"] == float(frequency)
        assert record.condition["current"] == float(current)
        said = [f.kind for f in record.findings]
        assert ("condition-differs" in said) == (stroke == "2")  # 1.62 mm where the name says 2 mm


def test_rig_logs_in_mat_files(real_logs: Path, tmp_path: Path) -> None:
    from scipy.io import loadmat

    recordings, _ = _read(real_logs, tmp_path, "mr_damper_labcontrol", TABLE)
    read = {Path(r.source).name: r for r in recordings}
    files = sorted((real_logs / "mr_damper_labcontrol").glob("*.mat"))
    assert sorted(read) == [f.name for f in files]
    for file in files:
        whole = loadmat(file)
        record = read[file.name]
        assert record.dt == pytest.approx(float(whole["Ts"].item()), rel=1e-6)
        np.testing.assert_allclose(record.channels["displacement"], whole["x_F"][:, 0] * mm, atol=1e-15)
        np.testing.assert_allclose(record.channels["velocity"], whole["x_F"][:, 1] * mm, atol=1e-15)
        np.testing.assert_allclose(record.channels["force"], whole["x_F"][:, 2], atol=1e-12)
        assert record.rows_refused == 0


def test_conditions_of_runs_come_from_the_map(real_logs: Path, tmp_path: Path) -> None:
    recordings, _ = _read(real_logs, tmp_path, "mr_damper_utfsm/raw/ME2mm5Hz.txt", RAW_PRESS)
    assert [r.condition["current"] for r in recordings] == [0.0, 0.25, 0.5, 0.75, 1.0]
    peaks = [float(np.ptp(r.channels["force"])) for r in recordings]
    assert peaks == sorted(peaks)  # a magnetorheological damper is stiffer at more current


def test_exchanged_force_and_displacement_are_noticed(real_logs: Path, tmp_path: Path) -> None:
    exchanged = RAW_PRESS.split("[[files]]")[0]  # the map of the other series
    recordings, _ = _read(real_logs, tmp_path, "mr_damper_utfsm/raw/ME5mm4Hz.txt", exchanged)
    assert all(any(f.kind == "sign" and f.channel == "force" for f in r.findings) for r in recordings)


def test_every_file_is_read_or_refused_and_claimed_once(real_logs: Path) -> None:
    recordings, refusals = examine([real_logs], Settings())
    files = {str(p) for p in real_logs.rglob("*") if p.is_file() and p.suffix not in (".md", ".toml")}
    joined = {str(p) for p in files if "F0004CH" in p or "I8-3-1-dc" in p}
    assert files - {r.source for r in recordings} - {r.path for r in refusals} <= joined
    for path in files - {r.path for r in refusals}:
        assert len(claims(open_head(Path(path)))) <= 1


@pytest.mark.parametrize("name", ["renamed.dat", "extensionless", "UPPER.CSV"])
def test_real_files_under_other_names(name: str, real_logs: Path, tmp_path: Path) -> None:
    for truth in TRUTHS:
        whole = real_logs / truth.file
        if truth.map or truth.piece or whole.is_dir() or truth.reader in ("lecroy",):
            continue
        other = tmp_path / name
        other.write_bytes(whole.read_bytes())
        recordings, _ = examine([other], Settings())
        assert recordings[0].reader == truth.reader
        assert recordings[0].rows_kept == truth.rows
