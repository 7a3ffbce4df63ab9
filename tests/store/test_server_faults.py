"""A server that is down, killed, cut off or full costs no verdict: runs wait on disk and arrive once."""

import os
import re
import shutil
import socket
import subprocess
import tempfile
import time
from contextlib import suppress
from pathlib import Path

import pytest
from made_up_runs import result, session
from postgres_cluster import BINARIES, Cluster
from server_faults import Proxy, ended, fill, two_benches

from etb_hil.base.errors import InputError
from etb_hil.base.stock import find
from etb_hil.cli.main import main
from etb_hil.store.address import store_address
from etb_hil.store.connection import connected
from etb_hil.store.queue import Queue
from etb_hil.store.reading import read_store

pytestmark = pytest.mark.skipif(
    not BINARIES and "ETB_HIL_NEEDS_POSTGRESQL" not in os.environ, reason="PostgreSQL is not installed"
)


@pytest.fixture
def own_cluster():
    """Return a server that may be killed."""
    folder = Path(tempfile.mkdtemp(prefix="etb-store-"))
    server = Cluster(folder)
    server.start()
    yield server
    server.stop()
    shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture
def lab(cluster, request):
    return cluster.new_database(f"faults_{abs(hash(request.node.nodeid))}")


def test_a_server_that_is_stopped_killed_and_started_loses_no_run(own_cluster, tmp_path):
    address = store_address(own_cluster.new_database("lab"))
    folders = [tmp_path / name for name in ("one", "two")]
    benches = two_benches(folders, address)
    for fault in (own_cluster.stop, own_cluster.kill, own_cluster.stop):
        time.sleep(1.0)
        fault()
        time.sleep(0.3)
        own_cluster.start()
    assert sum(one["waited"] for one in ended(benches)) > 0
    for folder in folders:
        assert Queue(folder).deliver(address).warnings == ()
    runs = read_store(address)
    assert sorted((run.bench, run.run_id) for run in runs) == [
        (name, f"run-{k:04d}") for name in ("one", "two") for k in range(100)
    ]
    assert all(len(run.numbers) == 1 for run in runs)


@pytest.mark.parametrize("most", [40, 900, 2500, 5000, 8000])
def test_a_connection_that_is_cut_loses_no_run(cluster, lab, tmp_path, most):
    direct = store_address(lab)
    Queue(tmp_path).add(result(0), session(tmp_path))
    Queue(tmp_path).deliver(direct)
    for number in range(1, 4):
        Queue(tmp_path).add(result(number), session(tmp_path))
    cut = store_address(lab.replace(str(cluster.port), str(Proxy(cluster.port, [most]).port)))
    Queue(tmp_path).deliver(cut)
    assert Queue(tmp_path).deliver(direct).waiting == 0
    assert [run.run_id for run in read_store(direct)] == [f"run-{k:04d}" for k in range(4)]


def test_a_server_that_says_nothing_is_given_up(tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as silent:
        Queue(tmp_path).add(result(0), session(tmp_path))
        start = time.monotonic()
        told = Queue(tmp_path).deliver(store_address(f"postgresql://b@127.0.0.1:{silent.getsockname()[1]}/lab"))
        assert told.waiting == 1
        assert "timeout" in told.warnings[0]
        assert time.monotonic() - start < 300.0


def test_a_full_disk_of_the_server_keeps_runs_waiting(tmp_path):
    place = Path(tempfile.mkdtemp(prefix="etb-full-"))
    mount = ["mount", "-t", "tmpfs", "-o", "size=100m", "none", str(place)]
    if subprocess.run(mount, check=False, stderr=subprocess.DEVNULL).returncode:
        place.rmdir()
        pytest.skip("no file system may be mounted")
    try:
        server = Cluster(place)
        server.start()
        address = store_address(server.new_database("lab"))
        for number in range(200):
            Queue(tmp_path).add(result(number), session(tmp_path))
        fill(place / "filler")
        told = Queue(tmp_path).deliver(address)
        assert told.waiting > 0
        assert told.warnings
        (place / "filler").unlink()
        with suppress(AssertionError):  # it may have ended, or be starting again by itself
            server.control("restart", "-m", "immediate")
        assert Queue(tmp_path).deliver(address).waiting == 0
        assert len(read_store(address)) == 200
        server.stop()
    finally:
        subprocess.run(["umount", "-l", str(place)], check=False)
        place.rmdir()


def test_a_run_whose_server_is_down_has_its_verdict(lab, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = find("bench", "virtual_classic").read_text("utf-8")
    Path("short.yaml").write_text(
        "schema: etb_hil/scenario/1\nname: Short\nphases:\n  - {id: off, kind: off, duration: 0.3 s}\n"
    )
    for address, is_up in ((re.sub(r":\d+/", ":1/", lab), False), (lab, True)):
        Path("bench.yaml").write_text(f"{text}\nstore: {address}\n")
        assert main(["run", "short.yaml", "--bench", "bench.yaml", "--yes"]) == 4
        said = capsys.readouterr()
        assert "INCONCLUSIVE" in said.out
        assert ("runs that wait in sessions/waiting_for_store: 1" in said.err) != is_up
    assert len(read_store(store_address(lab))) == 2
    assert not list(Path("sessions").glob("*.db"))
    assert main(["history", lab]) == 0
    assert "Runs 2" in capsys.readouterr().out


def test_a_password_is_refused_in_files_and_never_shown(tmp_path, capsys):
    text = find("bench", "virtual_classic").read_text("utf-8")
    for line in ("store: postgresql://me:s3cret@lab/db", "stor: postgresql://me:s3cret@lab/db"):
        (tmp_path / "bench.yaml").write_text(f"{text}\n{line}\n")
        assert main(["run", "--bench", str(tmp_path / "bench.yaml"), "--out", str(tmp_path / "s")]) == 2
        said = capsys.readouterr()
        assert "s3cret" not in said.out + said.err
        assert "bench.yaml" in said.err
    with pytest.raises(InputError, match="PGPASSWORD") as refused:
        store_address("postgresql://me:s3cret@lab/db")
    assert "s3cret" not in str(refused.value)
    assert not (tmp_path / "s").exists()


def test_the_password_comes_from_environment_or_file(own_cluster, tmp_path, monkeypatch):
    address = store_address(own_cluster.new_database("lab"))
    with connected(address) as connection:
        connection.execute("ALTER USER bench PASSWORD 's3cret'")
    rules = own_cluster.data / "pg_hba.conf"
    rules.write_text("host all all 127.0.0.1/32 scram-sha-256\n")
    own_cluster.control("reload")
    Queue(tmp_path).add(result(0), session(tmp_path))
    monkeypatch.setenv("PGPASSFILE", "/dev/null")
    assert Queue(tmp_path).deliver(address).waiting == 1
    monkeypatch.setenv("PGPASSWORD", "wrong-s3cret")
    told = Queue(tmp_path).deliver(address)
    assert "password authentication failed" in told.warnings[0]
    assert "s3cret" not in "".join(told.warnings)
    monkeypatch.delenv("PGPASSWORD")
    secret = tmp_path / "pass"
    secret.write_text("*:*:*:*:s3cret\n")
    secret.chmod(0o600)
    monkeypatch.setenv("PGPASSFILE", str(secret))
    assert Queue(tmp_path).deliver(address).arrived == 1
    assert os.environ.get("PGPASSWORD") is None
