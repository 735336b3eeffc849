"""What each real instrument file holds, as a look at its bytes gives it.

The numbers were taken from the files with a text editor, ``wc`` and ``str.split``, those of MAT-files with scipy; not
with mrfit.
"""

from dataclasses import dataclass

import numpy as np

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
          {"displacement": ("m", -0.131, 0.03), "angle": ("rad", -1.42546245919478, 0.326441784548422),
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
          {"displacement": ("m", 0.0, 0.0806174730721144 * cm), "velocity": ("m/s", 0.0, -13.06581639127374 * cm),
           "acceleration": ("m/s^2", 0.0, 41.50184719676812 * cm), "force": ("N", 0.0, -792.5284011265438),
           "voltage": ("V", 1.125, 1.0332256437717233)}, map=SPENCER),
    Truth("mr_damper_sano_keio/Magneto.mat", "matlab", 2000, 200, 0.0,
          {"velocity": ("m/s", 5.902489631116747 * cm, 1.838488964975252 * cm),
           "force": ("N", -66.74013643746812, -49.79050951486071)}, map=KEIO, pieces=2),
    Truth("mr_damper_sano_keio/Magneto.mat", "matlab", 1499, 200, 0.0,
          {"velocity": ("m/s", 2.155996231973529 * cm, 1.9654873299006224 * cm),
           "force": ("N", -31.356242470793326, 45.9068438481764)}, map=KEIO, piece=1, pieces=2),
    Truth("benchmark_wiener_hammerstein/wh.mat", "matlab", 99999, 51200, 0.0,
          {"voltage": ("V", -0.034677523508435115, -0.18780797385261394)}, map=WIENER, pieces=2),
    Truth("benchmark_wiener_hammerstein/wh.mat", "matlab", 78800, 51200, 0.0,
          {"voltage": ("V", 0.5579304524871986, -1.158435290271882)}, map=WIENER, piece=1, pieces=2),
    Truth("damper_dyno_python_daq/t1_1_1_18_18_s5_n10_150psi.csv", "delimited", 3150, 300, 0.0,
          {"force": ("N", 18.494916091026347, 43.747203812959405),
           "force_v": ("V", 0.09322974136014894, 0.22052224928399740),
           "displacement": ("m", 49.31088863680873 * mm, 41.207770121206075 * mm),
           "displacement_v": ("V", 5.115237410457336, 4.27466495033258),
           "temperature": ("degC", 25.776273805895222, 25.776273805895222),
           "temperature_v": ("V", 1.0155254761179044, 1.0155254761179044)}),
    Truth("damper_dyno_python_daq/t1_2_2_18_18_s5_n10_50psi.csv", "delimited", 3150, 300, 0.0,
          {"force": ("N", 32.817595471955414, 13.764190892994648),
           "force_v": ("V", 0.16542794370377767, 0.06938295641190971),
           "displacement": ("m", 32.036118952584204 * mm, 12.9430332032185 * mm),
           "displacement_v": ("V", 3.3232488540025105, 1.342638299089056),
           "temperature": ("degC", 22.881762513633433, 23.317583791134396),
           "temperature_v": ("V", 0.9576352502726686, 0.9663516758226879)}),
    Truth("damper_dyno_python_daq/t1_2_2_24_24_s5_n10_100psi.csv", "delimited", 3150, 300, 0.0,
          {"force": ("N", -61.626087602868765, -13.829442273919403),
           "force_v": ("V", 0.3106466760906783, 0.06971187757797864),
           "displacement": ("m", 16.00762087420678 * mm, 20.174069695158874 * mm),
           "displacement_v": ("V", 1.660541584461284, 2.092745818999883),
           "temperature": ("degC", 26.647916488333514, 28.00471884931398),
           "temperature_v": ("V", 1.0329583297666702, 1.0600943769862796)}),
    Truth("mts_mpt_cyclic_es/sampledatafiletype1.dat", "mts-mpt", 51, 512, 10.016357,
          {"displacement": ("m", -0.095496617 * mm, -0.095166318 * mm),
           "force": ("N", -4.1995568 * kgf, -4.2503896 * kgf), "channel_1_recuento": ("1", 99.0, 99.5)}, pieces=10),
    Truth("mts_mpt_cyclic_es/sampledatafiletype1.dat", "mts-mpt", 51, 512, 100.01636,
          {"displacement": ("m", -0.4152756 * mm, -0.41461548 * mm),
           "force": ("N", -6.8788729 * kgf, -7.3198833 * kgf), "channel_1_recuento": ("1", 999.0, 999.5)},
          piece=9, pieces=10),
    Truth("mts_testsuite/I8-3-1-dc", "mts-testsuite", 7581, 100, 16.6609992980957,
          {"displacement": ("m", -1.69551419094205 * mm, np.nan),
           "force": ("N", 0.000294344295980409, np.nan)}, samples=7584),
    Truth("labview_lvm/multi_time_column.lvm", "labview-lvm", 3, 51200, 0.0,
          {"voltage": ("V", -0.035229, -0.034191), "acceleration": ("m/s^2", 0.532608 * kgf, 0.467541 * kgf)}),
    Truth("labview_lvm/with_comments.lvm", "labview-lvm", 9, 0.0, 0.0,
          {"temperature": ("degC", 5.479238, np.nan), "volume": ("m^3", 0.0, np.nan),
           "pressão_abs.": ("Pa", 1.833787e6, np.nan)}, samples=13),
    Truth("labview_lvm/long_single_header_multi_ch.lvm", "labview-lvm", 16384, 1 / 0.000977, 0.0,
          {"f": ("m/s^2", 0.052530 * kgf, 0.052073 * kgf), "m_1": ("m/s^2", 0.234571, 0.235689),
           "m_2": ("m/s^2", 0.244440, 0.263686)}),
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
    _press("25mm0x5Hz0A", 4940, 200, (-0.052391672, -1.095, -39.880332), (0.00038332827, -1.285, -75.932029)),
    _press("25mm0x5Hz1A", 4595, 200, (-0.024899864, -1.19, -192.81989), (0.031325136, -1.375, -492.9328)),
    _press("2mm5Hz0A", 449, 200, (-0.026156111, -1.2, -90.296201), (-0.045656111, 1.2, 73.523887)),
    _press("2mm5Hz0x25A", 451, 200, (-0.02522677, -1.35, -94.404899), (-0.04997677, 1.2, 213.10713)),
    _press("2mm5Hz0x5A", 448, 200, (-0.024562918, -1.05, -96.34018), (-0.044812918, 1.05, 264.32389)),
    _press("2mm5Hz0x75A", 479, 200, (0.00031041667, 2.0, 236.28755), (-0.051439583, 1.7, 329.08298)),
    _press("2mm5Hz1A", 450, 200, (-0.029626386, -1.8, -108.23769), (-0.049876386, 1.2, 312.22243)),
    _press("5mm3Hz0A", 4032, 1000, (-0.011395863, 1.0909091, 62.834463), (0.00069504617, -1.0, -59.775407)),
    _press("5mm3Hz0x5A", 4257, 1000, (-0.052022759, -1.0, -79.793665), (-0.019113668, -0.90909091, -198.67404)),
    _press("5mm3Hz1A", 4308, 1000, (-0.038709966, -1.0909091, -53.603014), (0.00059306455, -1.2121212, -316.341)),
    _rig("data_simulation_4.1_MRdamper", 3001, 100, (-12.6075, 0, -50.7662822855),
         (6.1175000001, -54.9999999994, -101.152475059)),
    _rig("ensaio.A.1", 1501, 100, (0, 0, 95.554705092), (-2.64, -3.5, -437.521543295)),
    _rig("ensaio.A.5", 1501, 100, (0, 0, 168.042624096), (-8.815, -3, -132.96011622)),
    _rig("ensaio.A.9", 1501, 100, (0.53, 0, 822.869457413), (4.65, 0, 230.977880494)),
    _rig("ensaio.B.1", 1501, 100, (0, 0, 103.114986041), (10.165, 59, 656.990671264)),
    _rig("ensaio.B.5", 1501, 100, (-7.44, 0, -28.0030237929), (-3.00999999999, 50, 509.951305832)),
    _rig("ensaio.B.9", 1501, 100, (0, 0, 106.486564649), (4.625, 38, 613.347419056)),
    _rig("ensaio.vali.2", 1501, 100, (0, 0, 94.2068057215), (8.855, 43, 381.531337924)),
    _rig("ensaio1", 3001, 100, (0, 0, 104.912269614), (2.24, -25.5, 62.8175902282)),
    _rig("ensaio2.2.2", 1501, 100, (-18.5225, 0, -71.4565954795), (11.0075, 51.5, 285.170469115)),
    _rig("ensaio3.1", 3001, 100, (0, 0, 86.9060528707), (21.775, -12.5, 78.6644447448)),
    _rig("ensaio5.1", 3001, 100, (0, 0, 87.8425992578), (2.785, -44.5, 33.8975303601)),
    _rig("ensaio5.2.2", 1501, 100, (-15.48, 0, -63.1215587193), (-11.805, -27, -274.775121861)),
    _rig("ensaio5.2", 3001, 100, (-12.04, 0, -51.0410075378), (3.62500000011, -56.4999999992, -229.356483477)),
    _rig("ensaio8.2.2", 1501, 100, (-11.425, 0, -61.6231149706), (8.73499999999, -27.5, -227.949106686)),
    _rig("ensaio9.1", 3001, 100, (0, 0, 96.1061058964), (8.375, 46.5, 221.413065305)),
    _rig("exp2", 751, 50, (7.5025, 0, -2.96677470487), (-4.38749999999, 27.5, 23.8027968867)),
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
