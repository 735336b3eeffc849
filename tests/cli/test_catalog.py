"""Public data are fetched from a server on this machine: right, wrong, broken off, missing, unreachable."""

import hashlib
import json
import resource
import socket
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from mrfit.cli.catalog import DataSet, default_catalog, fetch, read_catalog
from mrfit.errors import ConfigError, DataError
from mrfit.ingest.stage import Settings
from tests.conftest import Run
from tests.ingest.examining import examine

LOG = "time,voltage,current\ns,V,A\n" + "".join(f"{k * 1e-3:.3f},{k % 7},{k % 5}\n" for k in range(20_000))
FILES = {"one.csv": LOG.encode(), "two.csv": LOG.replace("voltage", "flux").replace("V,", "Wb,").encode()}


class Server:
    """Serves files; ``faults`` says which answer is wrong: missing, other, short, cut or long."""

    def __init__(self) -> None:
        self.faults: dict[str, str] = {}
        self.asked: list[str] = []
        server = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                name = self.path.strip("/")
                server.asked.append(name)
                fault = server.faults.get(name, "")
                body = FILES[name]
                sent = {"other": body[::-1], "short": body[:-100], "cut": body[:-100], "long": body + b"x"}.get(
                    fault, body
                )
                if fault == "missing":
                    self.send_error(404)
                    return
                self.send_response(200)
                self.send_header("Content-Length", str(len(body) if fault == "cut" else len(sent)))
                self.end_headers()
                self.wfile.write(sent)

            def log_message(self, format: str, *args: object) -> None:
                pass

        self.http = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.thread = threading.Thread(target=self.http.serve_forever, kwargs={"poll_interval": 0.01})
        self.thread.start()
        self.address = f"http://127.0.0.1:{self.http.server_port}"

    def stop(self) -> None:
        self.http.shutdown()
        self.http.server_close()
        self.thread.join()


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> Iterator[Server]:
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")
    running = Server()
    yield running
    running.stop()


def catalog_text(address: str, channel_map: str = "") -> str:
    text = f'[bench]\ntitle = "Two logs"\nlicence = "MIT"\ncite = "A. Author, 2024"\nmap = {json.dumps(channel_map)}\n'
    for name, data in FILES.items():
        digest = hashlib.sha256(data).hexdigest()
        text += f'[[bench.files]]\nname = "{name}"\naddress = "{address}/{name}"\nsize = {len(data)}\n'
        text += f'sha256 = "{digest}"\n'
    return text


def sets_of(tmp_path: Path, address: str, channel_map: str = "") -> dict[str, DataSet]:
    file = tmp_path / "catalog.toml"
    file.write_text(catalog_text(address, channel_map))
    return read_catalog(file)


def inside(folder: Path) -> list[str]:
    return sorted(p.name for p in folder.iterdir())


def test_files_arrive_and_are_not_fetched_again(server: Server, tmp_path: Path) -> None:
    sets, folder = sets_of(tmp_path, server.address), tmp_path / "to" / "bench"
    told: list[tuple[str, int, int]] = []
    first = fetch(sets, "bench", folder, lambda *step: told.append(step))
    assert {n: (folder / n).read_bytes() for n in inside(folder)} == FILES
    assert [f["state"] for f in first["files"]] == ["fetched", "fetched"]
    assert first["next"] == f"mrfit ingest {folder}" and first["cite"] == "A. Author, 2024"
    total = sum(map(len, FILES.values()))
    assert told[-1] == ("fetch bench", total, total)
    done = [d for _, d, _ in told]
    assert done == sorted(done) and len(set(done)) > 6  # several steps within a file
    again = fetch(sets, "bench", folder)
    assert [f["state"] for f in again["files"]] == ["there", "there"]
    assert server.asked == ["one.csv", "two.csv"]


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("other", "has SHA-256 .* not kept"),
        ("short", "ended after .* not kept"),
        ("cut", "broke off after|ended after"),
        ("long", "is longer than the .* bytes of the catalog: not kept"),
        ("missing", "answers 404 Not Found: try later, or put the file into .* by hand"),
    ],
)
def test_a_bad_file_is_not_kept_and_the_others_are(fault: str, words: str, server: Server, tmp_path: Path) -> None:
    server.faults["one.csv"] = fault
    sets = sets_of(tmp_path, server.address)
    with pytest.raises(DataError, match=words) as error:
        fetch(sets, "bench", tmp_path / "bench")
    assert "one.csv" in str(error.value) and "\n" not in str(error.value)
    assert inside(tmp_path / "bench") == ["two.csv"]
    server.faults.clear()
    states = [f["state"] for f in fetch(sets, "bench", tmp_path / "bench")["files"]]
    assert states == ["fetched", "there"]
    assert server.asked == ["one.csv", "two.csv", "one.csv"]


def test_a_damaged_file_is_replaced_only_by_a_right_one(server: Server, tmp_path: Path) -> None:
    sets, folder = sets_of(tmp_path, server.address), tmp_path / "bench"
    fetch(sets, "bench", folder)
    (folder / "one.csv").write_text("edited")
    server.faults["one.csv"] = "other"
    with pytest.raises(DataError, match="SHA-256"):
        fetch(sets, "bench", folder)
    assert (folder / "one.csv").read_text() == "edited"
    server.faults.clear()
    assert [f["state"] for f in fetch(sets, "bench", folder)["files"]] == ["replaced", "there"]


def test_no_server_is_one_line_and_leaves_nothing(tmp_path: Path, mrfit: Run) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        (tmp_path / "own.toml").write_text(catalog_text(f"http://127.0.0.1:{free.getsockname()[1]}"))
        result = mrfit("datasets", "bench", "--catalog", "own.toml")
    assert result.returncode == 1 and result.stdout == ""
    assert result.stderr.count("\n") == 1
    assert "cannot be reached (Connection refused" in result.stderr.replace("[Errno 111] ", "")
    assert "check the network" in result.stderr
    assert inside(tmp_path) == ["own.toml"]


def test_the_command_says_where_and_what_next(server: Server, tmp_path: Path, mrfit: Run) -> None:
    (tmp_path / "own.toml").write_text(catalog_text(server.address))
    result = mrfit("datasets", "bench", "--catalog", "own.toml", "--to", "my logs")
    assert result.returncode == 0, result.stderr
    assert "Cite: A. Author, 2024" in result.stdout
    assert "Next: mrfit ingest 'my logs'" in result.stdout
    summary = json.loads(mrfit("datasets", "bench", "--catalog", "own.toml", "--to", "my logs", "--json").stdout)
    assert [f["state"] for f in summary["files"]] == ["there", "there"]
    recordings, refusals = examine([tmp_path / "my logs"], Settings())
    assert len(recordings) == 2 and not refusals


def test_the_list_says_size_licence_and_citation(mrfit: Run) -> None:
    rows = json.loads(mrfit("datasets", "--json").stdout)
    by_name = {r["name"]: r for r in rows}
    assert by_name["mr_damper_utfsm"]["files"] == 5 and by_name["mr_damper_utfsm"]["bytes"] == 639_540
    printed = mrfit("datasets").stdout
    for row in rows:
        assert row["name"] in printed and row["licence"] in printed
    assert "0.64 MB" in printed and "github.com/DanielMaurelE" in printed


def test_unknown_name_suggests_near_ones(mrfit: Run) -> None:
    result = mrfit("datasets", "mr_damper_utfms")
    assert result.returncode == 2
    assert "did you mean mr_damper_utfsm" in result.stderr and "`mrfit datasets` shows all" in result.stderr


def test_a_place_that_cannot_be_written_is_named(server: Server, tmp_path: Path) -> None:
    sets = sets_of(tmp_path, server.address)
    with pytest.raises(DataError, match=r"cannot be made .* --to"):
        fetch(sets, "bench", tmp_path / "catalog.toml" / "bench")
    (tmp_path / "bench" / "one.csv").mkdir(parents=True)
    with pytest.raises(DataError, match=r"one.csv: cannot be read .* --to"):
        fetch(sets, "bench", tmp_path / "bench")


def test_a_full_disk_leaves_no_half_file(server: Server, tmp_path: Path) -> None:
    """A limit on the size of files stands for the disk: the system refuses the write in the same way."""
    sets = sets_of(tmp_path, server.address)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, before[1]))
    try:
        with pytest.raises(DataError, match=r"one.csv: cannot be written .* make room"):
            fetch(sets, "bench", tmp_path / "bench")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert not (tmp_path / "bench").exists()


def test_the_channel_map_comes_with_the_files_but_not_over_the_users(server: Server, tmp_path: Path) -> None:
    sets, folder = sets_of(tmp_path, server.address, "dt = 0.001\n"), tmp_path / "bench"
    assert "channel map" in fetch(sets, "bench", folder)["notes"][0]
    assert (folder / "mrfit.toml").read_text() == "dt = 0.001\n"
    assert fetch(sets, "bench", folder)["notes"] == []
    (folder / "mrfit.toml").write_text("dt = 0.002\n")
    assert "kept as it is" in fetch(sets, "bench", folder)["notes"][0]
    assert (folder / "mrfit.toml").read_text() == "dt = 0.002\n"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('name = "one.csv"', 'name = "../one.csv"', "bench.files.0.name"),
        ('name = "one.csv"', 'name = ".bashrc"', "bench.files.0.name"),
        ('address = "http', 'address = "file', "bench.files.0.address"),
        ("size = ", "size = -", "bench.files.0.size"),
        ('sha256 = "', 'sha256 = "z', "bench.files.0.sha256"),
        ("licence", "license", "bench.licen"),
        ("[bench]", "[bench", "is not valid TOML"),
    ],
)
def test_a_wrong_catalog_names_its_key(old: str, new: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text(catalog_text("http://127.0.0.1:1").replace(old, new))
    with pytest.raises(ConfigError, match=words):
        read_catalog(tmp_path / "own.toml")


def test_a_missing_catalog_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="give the path of a data catalog"):
        read_catalog(tmp_path / "none.toml")


def test_maps_of_the_shipped_catalog_read_the_real_files(real_logs: Path, tmp_path: Path) -> None:
    folders = {"mr_damper_utfsm": "mr_damper_utfsm/preprocessed", "mr_damper_labcontrol": "mr_damper_labcontrol"}
    sets = read_catalog()
    assert set(sets) == set(folders)
    for name, chosen in sets.items():
        channel_map = tmp_path / f"{name}.toml"
        channel_map.write_text(chosen.map)
        logs = [real_logs / folders[name] / f.name for f in chosen.files if not f.name.endswith(".ods")]
        for file in chosen.files:
            data = (real_logs / folders[name] / file.name).read_bytes()
            assert (len(data), hashlib.sha256(data).hexdigest()) == (file.size, file.sha256)
        recordings, refusals = examine(logs, Settings(map=channel_map))
        assert not refusals and len(recordings) == len(logs)
        for record in recordings:
            assert {"displacement", "velocity", "force"} <= set(record.channels)


def test_the_catalog_is_found_in_a_clone(datasets: Path) -> None:
    assert default_catalog() == datasets / "catalog.toml"
