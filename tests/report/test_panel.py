"""The panel in a terminal of 80 x 24, in a pipe, when it stalls and when it dies."""

import fcntl
import io
import os
import pty
import select
import signal
import struct
import subprocess
import sys
import termios
import time
from dataclasses import replace
from pathlib import Path

import pyte
import pytest
from rich.console import Console
from run_with_panel import FULL

from etb_hil.bench.snapshot import Snapshot
from etb_hil.report.panel import new_messages
from etb_hil.report.panel_feed import PanelFeed, PanelSnapshot
from etb_hil.report.panel_view import draw
from etb_hil.report.panel_watcher import PanelLimits, PanelWatcher

HERE = Path(__file__).parent
PATIENCE_S = 60.0  # for a loaded machine; nothing waits that long on a good day


class Terminal:
    """A program in a terminal of 80 x 24, and what stands on its screen."""

    def __init__(self, *command, **variables):
        self.screen = pyte.Screen(80, 24)
        self._stream = pyte.ByteStream(self.screen)
        self.bytes = b""
        self._main, side = pty.openpty()
        fcntl.ioctl(side, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
        environment = {k: v for k, v in os.environ.items() if k not in {"NO_COLOR", "COLUMNS", "LINES", "FORCE_COLOR"}}
        self.program = subprocess.Popen(
            [sys.executable, *command],
            cwd=HERE,
            stdin=subprocess.PIPE,
            stdout=side,
            stderr=subprocess.PIPE,
            env={**environment, "TERM": "xterm-256color", **variables},
        )
        os.close(side)

    def text(self):
        return "\n".join(line.rstrip() for line in self.screen.display)

    def until(self, expected):
        deadline = time.monotonic() + PATIENCE_S
        while expected not in self.text():
            assert time.monotonic() < deadline, self.text()
            self.pump()
        return self.text()

    def pump(self):
        if select.select([self._main], [], [], 0.05)[0]:
            try:
                data = os.read(self._main, 65536)
            except OSError:  # the other side is closed
                return False
            self.bytes += data
            self._stream.feed(data)
            return bool(data)
        return self.program.poll() is None

    def end(self):
        self.program.stdin.write(b"\n")
        self.program.stdin.flush()
        while self.pump():
            pass
        self.program.communicate(timeout=PATIENCE_S)
        os.close(self._main)
        return self.text()


@pytest.mark.parametrize(
    "variables", [{}, {"NO_COLOR": "1"}, {"PYTHONIOENCODING": "ascii:replace"}], ids=["plain", "colourless", "ascii"]
)
def test_everything_stands_on_an_80_by_24_screen(variables):
    terminal = Terminal("run_with_panel.py", "wait", **variables)
    shown = terminal.until("[bold]no markup[/bold]")  # its last line
    for expected in (
        "friction check, serial ETB-0042",
        "phase  ramp opening",
        "52 %   12.4 s   0:11 left",
        "14.3 deg/s",
        "1.234 A",
        "23.4",
        "friction            0.302",
        "limit 0.250 N",
        "[####################] OVER",
        "break-away friction 0.171",
        "[##############......]  68 %",
        "sliding friction    0.165",
        "bus load 61.4 %  lost frames 0",
        "> homing done",
        "[bold]no markup[/bold]",
    ):
        assert expected in shown
    assert b"\x1b[31mred" not in terminal.bytes
    last = terminal.end()
    assert "#####  ###  ### #" in last  # the verdict has taken the panel's place, and stays
    assert "Break-away friction is 0.567" in last
    assert "bus load" not in last
    assert not terminal.screen.cursor.hidden
    assert terminal.program.returncode == 0
    if "NO_COLOR" in variables:
        assert not [code for code in (b"\x1b[31m", b"\x1b[1;31m", b"\x1b[32m", b"\x1b[33m") if code in terminal.bytes]


def test_a_dumb_terminal_gets_lines_without_control_codes():
    terminal = Terminal("run_with_panel.py", "wait", TERM="dumb")
    terminal.until("42.31 deg")
    terminal.end()
    assert b"\x1b" not in terminal.bytes


def test_ctrl_c_is_left_to_the_run():
    terminal = Terminal("run_with_panel.py", "wait")
    terminal.until("42.31 deg")
    panel = children(terminal.program.pid)
    assert len(panel) == 1
    os.kill(panel[0], signal.SIGINT)
    assert os.getpgid(panel[0]) != os.getpgid(terminal.program.pid)
    assert "Break-away friction is 0.567" in terminal.end()
    assert b"Traceback" not in terminal.bytes


def children(pid):
    tasks = Path(f"/proc/{pid}/task/{pid}/children")
    return [int(word) for word in tasks.read_text().split()]


def test_a_log_gets_plain_lines():
    run = subprocess.run([sys.executable, "run_with_panel.py", "go"], cwd=HERE, capture_output=True, check=True)
    assert b"\x1b" not in run.stdout
    text = run.stdout.decode()
    lines = text.splitlines()
    assert lines[0].split()[:4] == ["0.0", "s", "home", "10"]
    assert "12.4 s  ramp opening  52 %  angle 42.31 deg  friction 0.302 N·m  T_st 0.171 N·m  T_c 0.165 N·m" in lines[1]
    assert lines[2].endswith("homing done")
    assert "FAIL - serial ETB-0042" in text
    assert run.stderr == b""


def test_the_run_goes_on_without_its_panel():
    run = subprocess.run(
        [sys.executable, "run_with_panel.py", "killed"], cwd=HERE, capture_output=True, text=True, check=True
    )
    assert "alive: False due: False the live panel ended early (code -9): it said nothing" in run.stdout
    assert "FAIL - serial ETB-0042" in run.stdout


def test_a_panel_that_cannot_be_drawn_tells_why(monkeypatch, tmp_path):
    (tmp_path / "sitecustomize.py").write_text("import os, sys; sys.stderr.write('no terminal here\\n'); os._exit(3)")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    feed = PanelFeed()
    feed.start()
    feed._process.wait(PATIENCE_S)
    feed.update(FULL)
    assert feed.close() == "the live panel ended early (code 3): no terminal here"
    assert feed.close() == ""


def test_a_panel_that_stalls_costs_snapshots_and_nothing_else():
    with PanelFeed() as feed:
        os.kill(feed._process.pid, signal.SIGSTOP)
        for _ in range(2000):  # far more than a pipe holds: any waiting would hang here for ever
            feed.update(FULL)
        assert feed.dropped > 0
        assert feed.alive
        os.kill(feed._process.pid, signal.SIGCONT)


@pytest.mark.parametrize("character", ["\x00", "\N{PILE OF POO}", "\ud800", '"'])
def test_longest_texts_arrive_whole(character):
    longest = character * 500
    with PanelFeed() as feed:
        texts = dict.fromkeys(("title", "phase", "question", "keys", "before"), longest)
        feed.update(PanelSnapshot(**texts, messages=(longest,) * 9))
        assert feed.dropped == 0
        assert feed.close() == ""


def test_a_question_takes_the_messages_place_and_all_of_it_fits():
    question = "Is the unit clamped, its connector locked and the hood closed? " * 4
    busiest = replace(FULL, question=question, keys="1 yes   2 no", before="last: A-1 pass; so far 1 unit: 1 pass")
    console = Console(width=80, file=io.StringIO(), record=True)
    console.print(draw(busiest, silent_s=9.0))
    shown = console.export_text().splitlines()
    assert len(shown) < 24
    assert max(map(len, shown)) == 80
    text = " ".join(line.strip("│ ") for line in shown)
    assert " ".join(question.split()) in " ".join(text.split())
    assert "keys: 1 yes   2 no" in text
    assert "last: A-1 pass" in text
    assert "homing done" not in text


def test_a_run_without_a_panel_feeds_nobody():
    feed = PanelFeed()
    assert not feed.due("home")
    feed.update(FULL)
    assert feed.close() == ""


def test_the_runs_side_loads_nothing_heavy():
    code = "import sys, etb_hil.report.panel_feed; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {name.split(".")[0] for name in run.stdout.split()}
    assert not loaded & {"rich", "numpy", "matplotlib", "pydantic", "jinja2"}


@pytest.mark.parametrize(
    ("before", "now", "gained"),
    [
        ((), (), ()),
        ((), ("a",), ("a",)),
        (("a",), ("a",), ()),
        (("a", "b", "c"), ("b", "c", "d"), ("d",)),
        (("a", "b", "c"), ("d", "e", "f"), ("d", "e", "f")),
    ],
)
def test_a_rolling_list_tells_what_is_new(before, now, gained):
    assert new_messages(before, now) == gained


class Kept(PanelFeed):
    """Keeps the snapshots that it is handed."""

    def __init__(self):
        super().__init__()
        self.kept = []

    def due(self, phase):
        return bool(phase)

    def update(self, snapshot):
        self.kept.append(snapshot)


def told(**changes):
    fields = {
        "time_s": 6.0, "total_s": 24.0, "phase": "ramp", "angle": 0.3, "velocity": 0.2, "current": 1.0,
        "temperature": float("nan"), "friction": None, "stiction": 0.17, "coulomb": None, "exceedances": 0,
        "bus_load": None, "frames_lost": 0, "message": "",
    }  # fmt: skip
    return Snapshot(**{**fields, **changes})


def test_the_watcher_shows_what_is_known_and_the_limit_that_applies():
    feed = Kept()
    watcher = PanelWatcher(feed, "a run", PanelLimits(0.25, 0.18, 7.8))
    for velocity, limit in ((0.2, 0.25), (-7.9, None), (-17.0, 0.18), (float("nan"), None)):
        watcher(told(velocity=velocity))
        assert feed.kept[-1].friction_limit == limit
    snapshot = feed.kept[0]
    assert (snapshot.temperature, snapshot.friction, snapshot.coulomb) == (None, None, None)
    assert (snapshot.progress, snapshot.stiction, snapshot.stiction_limit) == (0.25, 0.17, 0.25)
    assert snapshot.time_left_s is None  # one snapshot gives no pace
    watcher(told(time_s=15.0))
    watcher(told(time_s=24.0))
    assert feed.kept[-2].time_left_s > 0.0
    assert feed.kept[-1].time_left_s == 0.0


def test_the_watcher_shows_question_keys_and_what_came_before():
    feed = Kept()
    watcher = PanelWatcher(feed, "a run", PanelLimits(), keys=lambda: "1 yes", before="last: A-1 pass")
    watcher(told(message="Clamped?"))
    watcher(told())
    assert [snapshot.question for snapshot in feed.kept] == ["Clamped?", ""]
    assert {(snapshot.keys, snapshot.before) for snapshot in feed.kept} == {("1 yes", "last: A-1 pass")}


def test_the_watcher_keeps_the_last_messages_once_each():
    feed = Kept()
    watcher = PanelWatcher(feed, "a run", PanelLimits())
    for message in ("a", "", "a", "b", "c", "d"):
        watcher(told(message=message, total_s=0.0))
    assert feed.kept[-1].messages == ("b", "c", "d")
    assert feed.kept[-1].progress is None
