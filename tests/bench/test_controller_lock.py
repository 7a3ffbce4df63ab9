"""One sender to each id of a bus: the second is told who it is, however it writes the bus; a killed one holds none."""

import os
import signal
import subprocess
import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path

import pytest

from etb_hil.base.errors import BenchFault
from etb_hil.base.outcome import ExitCode
from etb_hil.base.stock import find
from etb_hil.bench.bench_file import load_bench
from etb_hil.bench.controller_lock import bench_lock, sender_lock
from etb_hil.canio.bus.bus_settings import BusSettings
from etb_hil.cli.main import main

VCAN0 = BusSettings(interface="socketcan", channel="vcan0")
COMMANDS = [(0x110, False), (0x111, False)]
GROUP = "239.74.163.2"
HOLD = """
import sys, time
from pathlib import Path
from etb_hil.bench.controller_lock import sender_lock
from etb_hil.canio.bus.bus_settings import BusSettings
bus = BusSettings(interface="socketcan", channel="vcan0")

folder = Path(sys.argv[1]) if len(sys.argv) > 1 else None
with sender_lock(bus, [(0x111, False)], "bench 'left'", folder) as paths:
    print(*paths, flush=True)
    time.sleep(600)
"""


def multicast(channel=GROUP, **options):
    return BusSettings(interface="udp_multicast", channel=channel, options=options)


def serial(channel, interface="slcan"):
    return BusSettings(interface=interface, channel=channel)


def excluded(tmp_path, bus, other, commands=COMMANDS, others=COMMANDS):
    said = ""
    with sender_lock(bus, commands, "bench 'left'", tmp_path), ExitStack() as second:
        try:
            second.enter_context(sender_lock(other, others, "bench 'right'", tmp_path))
        except BenchFault as fault:
            said = str(fault)
    assert not said or f"by bench 'left', process {os.getpid()}; wait for it, stop it, or choose" in said
    return bool(said)


def test_a_second_bench_is_told_who_sends(tmp_path):
    assert excluded(tmp_path, VCAN0, VCAN0)
    with sender_lock(VCAN0, COMMANDS, "bench 'left'", tmp_path):
        pass


@pytest.mark.parametrize(
    ("bus", "other"),
    [
        (multicast(), multicast(port=43113)),
        (multicast("ff15:7079::1"), multicast("FF15:7079:0::1")),
        (serial("/dev/null"), serial("/dev/null@115200")),
        (serial("/dev/null"), serial("/dev/../dev/null", "serial")),
    ],
)
def test_a_bus_is_the_same_however_it_is_written(tmp_path, bus, other):
    assert excluded(tmp_path, bus, other)
    assert excluded(tmp_path, other, bus)


def test_a_device_is_the_same_by_its_link(tmp_path):
    link = tmp_path / "usb-adapter-if00"
    link.symlink_to("/dev/null")
    assert excluded(tmp_path, serial("/dev/null"), serial(str(link)))


@pytest.mark.parametrize(
    "other",
    [BusSettings(interface="socketcan", channel="vcan1"), multicast(), multicast(port=43001), serial("/dev/../vcan0")],
)
def test_another_bus_is_free(tmp_path, other):
    assert not excluded(tmp_path, VCAN0, other)
    assert not excluded(tmp_path, multicast(port=43002), other)


@pytest.mark.parametrize(
    ("others", "overlap"),
    [
        ([(0x111, False), (0x112, False)], True),
        ([(0x10F, False), (0x110, False)], True),
        ([(0x112, False), (0x113, False)], False),
        ([(0x110, True), (0x111, True)], False),  # extended identifiers are others
    ],
)
def test_ids_that_overlap_exclude_each_other(tmp_path, others, overlap):
    assert excluded(tmp_path, VCAN0, VCAN0, others=others) is overlap
    assert excluded(tmp_path, VCAN0, VCAN0, commands=others, others=COMMANDS) is overlap
    with sender_lock(VCAN0, others, "bench 'left'", tmp_path):  # whoever was refused holds nothing of it
        pass


@pytest.mark.parametrize(("offset", "overlap"), [(0, True), (1, True), (2, False), (0x100, False)])
def test_bench_files_exclude_each_other_by_what_they_command(tmp_path, offset, overlap):
    stock = find("bench", "vcan_classic")
    beside = tmp_path / "beside.yaml"
    beside.write_text(stock.read_text() + f"id_offset: {offset}\n")
    with bench_lock(load_bench(stock), tmp_path), ExitStack() as second:
        if overlap:
            with pytest.raises(BenchFault, match=r"0x11[01] on socketcan vcan0 is sent already"):
                second.enter_context(bench_lock(load_bench(beside), tmp_path))
        else:
            assert len(second.enter_context(bench_lock(load_bench(beside), tmp_path))) == 2


def test_a_killed_bench_holds_nothing(tmp_path):
    with subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path)], stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout.readline()
        with (
            pytest.raises(BenchFault, match=f"bench 'left', process {holder.pid};"),
            sender_lock(VCAN0, COMMANDS, "bench 'right'", tmp_path),
        ):
            pass
        holder.send_signal(signal.SIGKILL)
    with sender_lock(VCAN0, COMMANDS, "bench 'right'", tmp_path):
        pass


@pytest.mark.skipif(sys.platform == "win32", reason="its folder does not hang on TMPDIR")
def test_no_folder_for_temporary_files_keeps_benches_apart(tmp_path):
    places = []
    for folder in (tmp_path / "a", tmp_path / "b"):
        folder.mkdir()
        environment = {**os.environ, "TMPDIR": str(folder), "TEMP": str(folder)}
        with subprocess.Popen(
            [sys.executable, "-c", HOLD.replace("vcan0", f"test{os.getpid()}")],
            stdout=subprocess.PIPE,
            text=True,
            env=environment,
        ) as holder:
            places.append(holder.stdout.readline().strip())
            holder.kill()
    assert places[0] == places[1]
    assert places[0].startswith(("/run/lock/", "/tmp/"))
    Path(places[0]).unlink()


def test_a_folder_that_cannot_be_used_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with (
        pytest.raises(BenchFault, match=r"cannot be opened: .*file.*let every user"),
        sender_lock(VCAN0, COMMANDS, "bench", tmp_path / "file"),
    ):
        pass


@pytest.mark.skipif(sys.platform != "linux", reason="socket names without a file are Linux's")
def test_a_lock_whose_file_is_removed_is_held(tmp_path):
    with sender_lock(VCAN0, COMMANDS, "bench 'left'", tmp_path) as paths:
        for path in paths:
            path.unlink()
        with (
            pytest.raises(BenchFault, match=f"0x110 .*is sent already, by process {os.getpid()};"),
            sender_lock(VCAN0, COMMANDS, "bench 'right'", tmp_path),
        ):
            pass
    with sender_lock(VCAN0, COMMANDS, "bench 'right'", tmp_path):
        pass


def test_no_link_is_followed(tmp_path):
    private = tmp_path / "private"
    private.mkdir(0o700)
    (private / "letter").write_text("dear")
    (tmp_path / "locks").symlink_to(private)
    assert "cannot be opened" in refused(tmp_path / "locks")
    (tmp_path / "folder").mkdir()
    for kind in (Path.symlink_to, Path.hardlink_to):
        lock = tmp_path / "folder" / "socketcan_vcan0_110.lock"
        kind(lock, private / "letter")
        assert "cannot be opened" in refused(tmp_path / "folder")
        lock.unlink()
    assert (private / "letter").read_text() == "dear"
    assert private.stat().st_mode & 0o7777 == 0o700


def refused(folder):
    with pytest.raises(BenchFault) as fault, sender_lock(VCAN0, COMMANDS, "bench", folder):
        pass
    return str(fault.value)


@pytest.fixture
def two_users():
    """Return the ids of two users without rights; the tests' own user has to be root to be them."""
    if not hasattr(os, "geteuid") or os.geteuid() != 0:
        pytest.skip("only root can start processes of two users")
    return 65533, 65534


@pytest.fixture
def shared():
    """Return a folder where every user can write, as /run/lock is; pytest's own are closed to other users."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o1777)
        yield folder


def as_user(user, code, *words):
    """Start code that becomes another user at its first empty line: not every user may read what it imports."""
    imports, _, rest = code.partition("\n\n")
    become = f"import fcntl, os; os.setgroups([]); os.setresgid({user}, {user}, {user}); os.setresuid(*[{user}] * 3)"
    command = [sys.executable, "-c", f"{imports}\n{become}\n{rest}", *words]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def test_two_users_share_locks_and_cannot_remove_each_others(two_users, shared):
    first, second = two_users
    locks = shared / "locks"
    with as_user(first, HOLD, str(locks)) as holder:
        path = holder.stdout.readline().strip()
        assert locks.stat().st_mode & 0o7777 == 0o1777
        assert locks.stat().st_uid == first
        with as_user(second, HOLD, str(locks)) as other:
            assert f"is sent already, by bench 'left', process {holder.pid}" in other.communicate()[1]
        with as_user(second, "import sys\n\nos.unlink(sys.argv[1])", path) as remover:
            assert "Operation not permitted" in remover.communicate()[1]
        holder.kill()
    with as_user(second, HOLD, str(locks)) as other:  # the file is the first user's, the lock is free
        assert other.stdout.readline().strip() == path
        other.kill()


def test_a_folder_of_another_user_without_the_sticky_bit_is_refused(two_users, shared):
    first, second = two_users
    with as_user(first, "import sys\n\nos.mkdir(sys.argv[1]); os.chmod(sys.argv[1], 0o777)", f"{shared}/locks"):
        pass
    with as_user(second, HOLD, f"{shared}/locks") as other:
        said = other.communicate()[1]
    assert "no sticky bit" in said
    assert f"chmod 1777 {shared}/locks" in said


def test_a_private_folder_of_another_user_stays_private(two_users, shared):
    first, second = two_users
    private = shared / "private"
    private.mkdir(0o700)
    os.chown(private, first, first)
    (shared / "locks").symlink_to(private)
    for user in (second, 0):
        with as_user(user, HOLD, f"{shared}/locks") as other:
            assert "cannot be opened" in other.communicate()[1]
    assert private.stat().st_mode & 0o7777 == 0o700
    assert not list(private.iterdir())


def test_a_second_controller_on_a_bus_is_refused(capsys):
    channel = f"test{os.getpid()}"  # the lock comes before the bus, which is not there
    bus = BusSettings(interface="socketcan", channel=channel)
    with sender_lock(bus, [(0x130, False)], "controller of 'first'") as paths:
        assert main(["controller", "--channel", channel]) == ExitCode.BENCH_FAULT
    said = capsys.readouterr().err
    assert f"0x130 on socketcan {channel} is sent already, by controller of 'first', process {os.getpid()}" in said
    for path in paths[0].parent.glob(f"socketcan_{channel}_*"):
        path.unlink()
