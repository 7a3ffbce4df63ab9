"""A run through a real ssh session: screen, keys and exit code come through, and a lost connection ends it safely."""

import getpass
import json
import os
import shlex
import shutil
import socket
import subprocess
import time
from pathlib import Path

import pytest
from terminal import ETB_HIL, PATIENCE_S, Terminal

from etb_hil.results.json_file import result_from_dict

SSHD = shutil.which("sshd") or shutil.which("sshd", path="/usr/sbin:/usr/local/sbin")
LACKING = (
    "no OpenSSH on this machine"
    if not (SSHD and shutil.which("ssh") and shutil.which("ssh-keygen"))
    else "sshd wants /run/sshd where root starts it"
    if os.geteuid() == 0 and not Path("/run/sshd").is_dir()
    else ""
)
pytestmark = pytest.mark.skipif(bool(LACKING), reason=LACKING)

LONG = """schema: etb_hil/scenario/1
name: held
phases:
  - {id: zero, kind: current_zero, duration: 0.3 s}
  - {id: clamped, kind: prompt, text: "Is the unit clamped?", answers: [yes, no], timeout: 100 s}
  - id: held # a wait is rehearsed in a second
    kind: wait
    drive: hold
    timeout: 450 s
    until: {role: temperature, above: 100 degC, otherwise: go_on}
"""
CONFIG = """ListenAddress 127.0.0.1
Port {port}
HostKey {folder}/host
AuthorizedKeysFile {folder}/user.pub
PidFile none
StrictModes no
UsePAM no
PasswordAuthentication no
KbdInteractiveAuthentication no
"""


@pytest.fixture
def over_ssh(tmp_path):
    """Return a function that runs a command on a terminal of 80 x 24, through an sshd with keys of its own."""
    keys = tmp_path / "keys"
    keys.mkdir(mode=0o700)
    for name in ("host", "user"):
        subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", keys / name], check=True)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    (keys / "config").write_text(CONFIG.format(port=port, folder=keys))
    server = subprocess.Popen([SSHD, "-D", "-e", "-f", keys / "config"], stderr=subprocess.PIPE)
    deadline = time.monotonic() + PATIENCE_S
    while not answers(port):
        assert server.poll() is None, server.stderr.read()
        assert time.monotonic() < deadline
        time.sleep(0.02)

    def start(*command, **variables):
        given = {name: os.environ[name] for name in ("PYTHONPATH", "HOME") if name in os.environ}
        settings = [f"{name}={value}" for name, value in {**given, **variables}.items()]
        remote = f"cd {shlex.quote(str(tmp_path))} && exec {shlex.join(['env', *settings, *command])}"
        options = [
            "StrictHostKeyChecking=no",
            f"UserKnownHostsFile={keys}/known",
            "IdentitiesOnly=yes",
            "LogLevel=ERROR",
        ]
        words = [word for option in options for word in ("-o", option)]
        ssh = ["ssh", "-tt", "-q", "-F", "none", "-i", str(keys / "user"), "-p", str(port), *words]
        return Terminal(tmp_path, *ssh, f"{getpass.getuser()}@127.0.0.1", remote)

    yield start
    server.terminate()
    server.wait()
    server.stderr.close()


def answers(port):
    try:
        socket.create_connection(("127.0.0.1", port), 1.0).close()
    except OSError:
        return False
    return True


def benches(folder):
    return [result_from_dict(json.loads(path.read_text())).bench for path in folder.glob("sessions/*/results.json")]


def test_a_run_is_seen_and_ended_over_ssh(over_ssh, tmp_path):
    (tmp_path / "held.yaml").write_text(LONG)
    terminal = over_ssh(*ETB_HIL, "run", "held.yaml", "--serial", "SN-9", NO_COLOR="1")
    terminal.until("? Is the unit clamped?")
    terminal.press("1")
    shown = terminal.until("phase  held")
    assert "held - serial SN-9" in shown
    assert max(map(len, shown.splitlines())) <= 80
    terminal.press("s")
    assert terminal.end() == 5
    assert "STOPPED - serial SN-9" in terminal.text
    assert b"\x1b[3" not in terminal.bytes  # colours of NO_COLOR
    (bench,) = benches(tmp_path)
    assert (bench.reason, bench.safe_state) == ("key s or r", True)


def test_a_connection_that_is_lost_takes_the_drive_off(over_ssh, tmp_path):
    (tmp_path / "held.yaml").write_text(LONG)
    terminal = over_ssh(*ETB_HIL, "run", "held.yaml")
    terminal.until("? Is the unit clamped?")
    terminal.press("1")
    terminal.until("phase  held")
    terminal.program.kill()
    deadline = time.monotonic() + PATIENCE_S
    while not benches(tmp_path):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    (bench,) = benches(tmp_path)
    assert (bench.outcome, bench.safe_state) == ("aborted", True)
    assert "SIGHUP" in bench.reason
    terminal.end()
