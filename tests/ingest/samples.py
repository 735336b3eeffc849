"""One small log per reader, written here as the instrument writes it, with what must be read from it."""

import io
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

ROWS = 240
DT = 1e-3
START = -0.05


@dataclass(frozen=True)
class Sample:
    """A log and its truth: channel name -> values and unit, in SI."""

    name: str
    data: bytes
    channels: dict[str, NDArray[np.float64]]
    units: dict[str, str]
    dt: float = DT
    start: float = START

    def write(self, folder: Path, name: str = "") -> Path:
        """Write the log into a folder."""
        path = folder / (name or self.name)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(self.data)
        return path


def signals() -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Time, and two signals of four decimals."""
    k = np.arange(ROWS)
    time = np.round(START + k * DT, 9)
    one = np.round(2.0 * np.sin(2 * np.pi * 10 * time) + 0.3 * np.sin(2 * np.pi * 31 * time), 4)
    two = np.round(1.5 * np.cos(2 * np.pi * 10 * time), 4)
    return time, one, two


def table(delimiter: str = ",", decimal: str = ".", end: str = "\n", tail: str = "", lead: str = "") -> str:
    """Rows of time and two signals."""
    lines = []
    for row in zip(*signals(), strict=True):
        cells = [f"{row[0]:.6f}", f"{row[1]:.4f}", f"{row[2]:.4f}"]
        lines.append(lead + delimiter.join(c.replace(".", decimal) for c in cells) + tail + end)
    return "".join(lines)


def _volts(*names: str) -> tuple[dict[str, NDArray[np.float64]], dict[str, str]]:
    _, one, two = signals()
    return dict(zip(names, (one, two), strict=False)), dict.fromkeys(names, "V")


def delimited() -> Sample:
    time, one, two = signals()
    text = "time [s],coil current [A],flux linkage [mWb]\n" + table()
    return Sample("log.csv", text.encode(), {"current": one, "flux": two * 1e-3}, {"current": "A", "flux": "Wb"})


def tektronix_mso() -> Sample:
    head = (
        "Model,MSO2014\r\nFirmware Version,1.35\r\n\r\nPoint Format,Y,\r\nHorizontal Units,S,\r\n"
        f"Sample Interval,{DT:g},\r\nRecord Length,{ROWS},\r\nVertical Units,V,\r\nLabel,,\r\nTIME,CH1,CH2\r\n"
    )
    return Sample("tek0000.csv", (head + table(end="\r\n")).encode(), *_volts("ch1", "ch2"))


def tektronix_tds() -> Sample:
    time, one, _ = signals()
    meta = [f"Record Length,{ROWS:e}", f"Sample Interval,{DT:e}", "Trigger Point,5.0e+01", ",", ",", ","]
    meta += ["Source,CH1", "Vertical Units,V", "Vertical Scale,2.0e-01", "Horizontal Units,s"]
    rows = [f"{meta[k] if k < len(meta) else ','},,{time[k]:016.9f},{one[k]:10.5f},\r\n" for k in range(ROWS)]
    return Sample("F0004CH1.CSV", "".join(rows).encode(), {"ch1": one}, {"ch1": "V"})


def rigol() -> Sample:
    _, one, two = signals()
    rows = "".join(f"{k},{one[k]:.4e},{two[k]:.4e},\r\n" for k in range(ROWS))
    head = f"X,CH1,CH2,Start,Increment,\r\nSequence,Volt,Volt,{START:e},{DT:e}\r\n"
    return Sample("NewFile1.csv", (head + rows).encode(), *_volts("ch1", "ch2"))


def keysight() -> Sample:
    head = "x-axis,1,4\nsecond,Volt,Volt\n"
    return Sample("scope_0.csv", (head + table()).encode(), *_volts("ch1", "ch4"))


def siglent() -> Sample:
    head = f"Record Length,Analog:{ROWS}\nSample Interval,CH1:{DT:.9f}\nVertical Units,CH1:V,,,\n"
    head += "Source,CH1,CH2\nSecond,Volt,Volt\n"
    return Sample("SDS00001.csv", (head + table(lead=" ")).encode(), *_volts("ch1", "ch2"))


def lecroy() -> Sample:
    time, one, _ = signals()
    head = f"LECROYWR6051,12904,Waveform\r\nSegments,1,SegmentSize,{ROWS}\r\nSegment,TrigTime,TimeSinceSegment1\r\n"
    head += "#1,02-Oct-2024 14:53:51,0                 \r\nTime,Ampl\r\n"
    rows = "".join(f"{t:.9f},{v:.4f}\r\n" for t, v in zip(time, one, strict=True))
    return Sample("C1Trace00000.txt", (head + rows).encode(), {"ch1": one}, {"ch1": "V"})


def picoscope() -> Sample:
    time, one, two = signals()
    head = "Frequency,Channel A,Channel B\r\n(ms),(V),(mV)\r\n\r\n"
    rows = "".join(f"{t * 1e3:.6f},{a:.4f},{b * 1e3:.1f}\r\n" for t, a, b in zip(time, one, two, strict=True))
    return Sample("pico.csv", (head + rows).encode(), *_volts("channel_a", "channel_b"))


def digilent() -> Sample:
    head = (
        f"#Digilent WaveForms Oscilloscope Acquisition\n#Sample rate: {1 / DT:g}Hz\n#Samples: {ROWS}\n#Phase: 0 ?\n\n"
    )
    head += "Time (s),Channel 1 (V),Channel 2 (V)\n"
    return Sample("acq0001.csv", (head + table()).encode(), *_volts("channel_1", "channel_2"))


def gwinstek() -> Sample:
    time, one, _ = signals()
    head = f"Memory Length,{ROWS},\r\nTrigger Level,-12.0mV,\r\nSource,CH1,\r\nVertical Units,V,\r\n"
    head += f"Horizontal Units,S,\r\nSampling Period,{DT:.3e},\r\nTime,08-Apr-21 15:43:51,\r\nWaveform Data,\r\n"
    rows = "".join(f"{t:.6e},{v:.4e},\r\n" for t, v in zip(time, one, strict=True))
    return Sample("DS0001.CSV", (head + rows).encode(), {"ch1": one}, {"ch1": "V"})


def leybold_cassy() -> Sample:
    _, one, two = signals()
    end = "\r\r\n"
    head = f"MIN=0\t-5\t-5{end}MAX=1\t5\t5{end}SCALE=1\t1\t1{end}DEC=1\t3\t4{end}"
    head += f'DEF="Zeit" t / s\t"Weg" s_A1 / m\t"Spannung" U_B1 / V{end}'
    data = b"\xef\xbb\xbf" + (head + table("\t", ",", end)).encode()
    return Sample("Cassy.txt", data, {"displacement": one, "voltage": two}, {"displacement": "m", "voltage": "V"})


def daq_text() -> Sample:
    _, one, two = signals()
    head = f"Header Size:  7\r\nVersion:  2\r\nSampling Interval:  {DT:g}\r\nSampling Rate:  {1 / DT:g}\r\n"
    head += f"Sample Count:  {ROWS}\r\nDevice Serial Number:  0\r\n"
    head += "Sample Number, Date/Time, CHANNEL0, CHANNEL1, Events\r\n"
    rows = []
    for k in range(ROWS):
        event = ", DAQ Start" if k == 0 else ""
        stamp = f"04/29/2022 12:11:{14 + k // 1000:02d}.{k % 1000:03d} PM"
        rows.append(f"{k + 1:10d},   {stamp}, {one[k]:.4f}, {two[k]:.4f}{event}\r\n")
    units = {"channel0": "", "channel1": ""}
    return Sample("ME2mm5Hz.txt", (head + "".join(rows)).encode(), {"channel0": one, "channel1": two}, units, start=0.0)


def mts_mpt() -> Sample:
    time, one, two = signals()
    head = "MTS793|MPT|ENU|1|2|.|/|:|51|1|1|A\t\t\t\r\n\t\t\t\r\nData Acquisition\t\tTime:\t59.9\ts\t1/9/2025 12:49\r\n"
    head += "Running Time\tUniversal Displacement\tUniversal Force\r\ns\tmm\tkN\r\n"
    rows = "".join(f"{t:.6f}\t{a * 10:.3f}\t{b:.4f}\t\r\n" for t, a, b in zip(time, one, two, strict=True))
    channels = {"displacement": one * 1e-2, "force": two * 1e3}
    return Sample("specimen.dat", (head + rows).encode(), channels, {"displacement": "m", "force": "N"})


def mts_testsuite() -> Sample:
    time, one, two = signals()
    head = "File Path: C:\\x\\DAQ- (Timed).txt   \nTest: double compression\nTest Run: Test Run 1\n"
    head += "Date: 10/23/2023 6:17:42 PM\n\n\n"
    head += "Crosshead \tLoad \tTime \nmm\tN\tsec\n"
    rows = "".join(f"{a:.4f}\t{b:.4f}\t{t:.6f}\n" for t, a, b in zip(time, one, two, strict=True))
    channels = {"displacement": one * 1e-3, "force": two}
    data = b"\xef\xbb\xbf" + (head + rows).encode()
    return Sample("DAQ- (Timed).txt", data, channels, {"displacement": "m", "force": "N"})


def labview_lvm() -> Sample:
    _, one, two = signals()
    head = "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t,\n"
    head += "Multi_Headings\tNo\nX_Columns\tNo\nTime_Pref\tAbsolute\n***End_of_Header***\t\n\t\nChannels\t2\t\t\n"
    head += f"Samples\t{ROWS}\t{ROWS}\t\nY_Unit_Label\tNewtons\tAmperes\t\nX_Dimension\tTime\tTime\t\n"
    head += f"X0\t{START}\t{START}\t\nDelta_X\t0,001000\t0,001000\t\n***End_of_Header***\t\t\t\n"
    head += "X_Value\tLoad\tCoil\tComment\n"
    head = head.replace(f"{START}", f"{START}".replace(".", ","))
    rows = "".join(f"\t{a:.4f}\t{b:.4f}\n".replace(".", ",") for a, b in zip(one, two, strict=True))
    return Sample("short.lvm", (head + rows).encode(), {"force": one, "current": two}, {"force": "N", "current": "A"})


def rohde_schwarz() -> Sample:
    _, one, two = signals()
    rows = "".join(f"{a:.4f},{b:.4f}\r\n" for a, b in zip(one, two, strict=True))
    return Sample("RefCurve.Wfm.csv", rows.encode(), *_volts("c1w1", "c2w1"))


RS_SETTINGS = f"XStart:{START}:\r\nXStop:0.19:\r\nRecordLength:{ROWS}:\r\nResolution:{DT}:\r\nSource:C1W1,C2W1:\r\n"


def parquet() -> Sample:
    import pyarrow as pa
    import pyarrow.parquet as pq

    time, one, two = signals()
    buffer = io.BytesIO()
    pq.write_table(pa.table({"time (s)": time, "current (mA)": one * 1e3, "ch2": two}), buffer)
    return Sample("log.parquet", buffer.getvalue(), {"current": one, "ch2": two}, {"current": "A", "ch2": ""})


def json_log() -> Sample:
    _, one, two = signals()
    content = {
        "dt": DT,
        "start": START,
        "units": {"current": "mA"},
        "current": list(one * 1e3),
        "force [kN]": list(two),
    }
    channels = {"current": np.array(content["current"]) * 1e-3, "force": two * 1e3}
    return Sample("run.json", json.dumps(content).encode(), channels, {"current": "A", "force": "N"}, start=0.0)


def matlab() -> Sample:
    from scipy.io import savemat

    time, one, two = signals()
    buffer = io.BytesIO()
    savemat(buffer, {"Tout": time, "Ts": DT, "x_F": np.column_stack([one, two])})
    return Sample("run.mat", buffer.getvalue(), {"x_f_0": one, "x_f_1": two}, {"x_f_0": "", "x_f_1": ""})


def seven_three(fill: Callable[[Any], None]) -> bytes:
    """A MATLAB 7.3 file: 512 bytes of MATLAB's own, then HDF5."""
    import h5py

    buffer = io.BytesIO()
    with h5py.File(buffer, "w", userblock_size=512) as file:
        fill(file)
    return b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512, b" ") + buffer.getvalue()[512:]


def matlab_seven_three() -> Sample:
    """A dSPACE capture in version 7.3: a struct array whose fields are references into #refs#."""
    import h5py

    time, one, two = signals()

    def put(file: Any, name: str, value: object) -> Any:
        kind, data = (
            ("char", np.array([[ord(c)] for c in value], np.uint16))
            if isinstance(value, str)
            else ("double", np.asarray(value)[:, None])
        )
        made = file.create_dataset(name, data=data)
        made.attrs["MATLAB_class"] = np.bytes_(kind)
        return made.ref

    def fill(file: Any) -> None:
        capture = file.create_group("rec")
        capture.attrs["MATLAB_class"] = capture.create_group("X").attrs["MATLAB_class"] = np.bytes_("struct")
        put(file, "rec/X/Data", time)
        y = capture.create_group("Y")
        y.attrs["MATLAB_class"] = np.bytes_("struct")
        fields = {"Name": ['"Root"/"force"', '"Root"/"current"'], "Unit": ["kN", "A"], "Data": [one, two]}
        for field, values in fields.items():
            references = [put(file, f"#refs#/{field}{k}", v) for k, v in enumerate(values)]
            y.create_dataset(field, data=np.array(references, dtype=h5py.ref_dtype)[:, None])

    channels = {"force": one * 1e3, "current": two}
    return Sample("rec.mat", seven_three(fill), channels, {"force": "N", "current": "A"})


def hdf5() -> Sample:
    import h5py

    _, one, two = signals()
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        file.attrs["sample_rate"] = 1.0 / DT
        for name, values, unit in (("rig/Force", one, "kN"), ("rig/Coil current", two, "A")):
            file.create_dataset(name, data=values).attrs["unit"] = unit
    channels = {"force": one * 1e3, "current": two}
    return Sample("run.h5", buffer.getvalue(), channels, {"force": "N", "current": "A"}, start=0.0)


def tdms() -> Sample:
    from nptdms import ChannelObject, TdmsWriter

    _, one, two = signals()
    buffer = io.BytesIO()
    clock = {"wf_increment": DT, "wf_start_offset": START}
    with TdmsWriter(buffer) as writer:
        writer.write_segment(
            [
                ChannelObject("rig", "Load", one, properties={**clock, "unit_string": "kN"}),
                ChannelObject("rig", "Coil", two, properties={**clock, "unit_string": "A"}),
            ]
        )
    return Sample("run.tdms", buffer.getvalue(), {"force": one * 1e3, "current": two}, {"force": "N", "current": "A"})


def mdf() -> Sample:
    import tempfile

    import asammdf

    time, one, two = signals()
    made = asammdf.MDF(version="4.10")
    made.append(
        [
            asammdf.Signal(one, time - START, name="Load", unit="kN"),
            asammdf.Signal(two, time - START, name="Coil", unit="A"),
        ]
    )
    with tempfile.TemporaryDirectory() as folder:
        path = made.save(Path(folder) / "run.mf4")
        data = Path(path).read_bytes()
    made.close()
    channels = {"force": one * 1e3, "current": two}
    return Sample("run.mf4", data, channels, {"force": "N", "current": "A"}, start=0.0)


WRITERS: dict[str, Callable[[], Sample]] = {
    "delimited": delimited,
    "tektronix-mso": tektronix_mso,
    "tektronix-tds": tektronix_tds,
    "rigol": rigol,
    "keysight": keysight,
    "siglent": siglent,
    "lecroy": lecroy,
    "picoscope": picoscope,
    "digilent": digilent,
    "gwinstek": gwinstek,
    "leybold-cassy": leybold_cassy,
    "daq-text": daq_text,
    "mts-mpt": mts_mpt,
    "mts-testsuite": mts_testsuite,
    "labview-lvm": labview_lvm,
    "rohde-schwarz": rohde_schwarz,
    "parquet": parquet,
    "json-log": json_log,
    "matlab": matlab,
    "hdf5": hdf5,
    "tdms": tdms,
    "mdf": mdf,
}

BINARY = ("parquet", "matlab", "hdf5", "tdms", "mdf")
"""Formats whose files are no text."""
NO_LINES = (*BINARY, "json-log")
"""Formats in which a sample has no line of its own: damage to rows, laid line by line, cannot be laid into them."""


def sample(reader: str, folder: Path, name: str = "") -> tuple[Sample, Path]:
    """Write the sample of a reader, and what must lie beside it, into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    made = WRITERS[reader]()
    if reader == "rohde-schwarz":
        (folder / "RefCurve.csv").write_text(RS_SETTINGS)
    return made, made.write(folder, name)


def parquet_of_mrfit(channels: dict[str, NDArray[np.float64]], about: dict[str, object]) -> bytes:
    """A recording as a workspace holds it."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    buffer = io.BytesIO()
    whole = pa.table(channels).replace_schema_metadata({"mrfit": json.dumps(about)})
    pq.write_table(whole, buffer)
    return buffer.getvalue()
