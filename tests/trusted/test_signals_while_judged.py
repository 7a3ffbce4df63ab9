"""Signals that come when the drive is off already: what is known of the unit is kept, and no one waits for ever."""

import json
import os
import signal
import sqlite3
import subprocess
import sys
from dataclasses import replace

import pytest
from whole_run import files

from etb_hil.bench.job import execute, prepare
from etb_hil.bench.stop_signals import StopSignals
from etb_hil.results.json_file import result_from_dict
from etb_hil.session.analysis import Analysis

SCENARIO = """schema: etb_hil/scenario/1
name: Short
phases:
  - {id: zero, kind: current_zero, duration: 0.3 s}
  - {id: off, kind: off, duration: 0.3 s}
"""
SUPPLIED = """schema: etb_hil/scenario/1
name: Supplied
supply: [{}]
phases:
  - {{id: held, kind: hold, position: 12 deg, duration: 0.2 s}}
"""
# argv: the signals during the run, those while the unit is judged, those while the report is written, the command
STRUCK = """
import os, signal, sys
from etb_hil.bench import job
from etb_hil.bench.runner import Runner
from etb_hil.cli import main
from etb_hil.report import html_report

def before(owner, name, numbers):
    whole = getattr(owner, name)
    def struck(*arguments, **options):
        for number in filter(None, numbers.split(",")):
            os.kill(os.getpid(), int(number))
        return whole(*arguments, **options)
    setattr(owner, name, struck)

in_run, in_judging, in_report, *command = sys.argv[1:]

class Struck(Runner):  # the rehearsal has one of the others
    pass

job.Runner = Struck
before(Struck, "_wake_controller", in_run)
before(Struck, "_finish_log", in_judging)
before(html_report, "write_report", in_report)
sys.exit(main.main(command))
"""


@pytest.fixture
def struck(tmp_path):
    """Run with signals; return the exit code, the session's folder, results, what the store says, and the words."""

    def run(in_run, in_judging, in_report=()):
        (tmp_path / "short.yaml").write_text(SCENARIO)
        numbers = [",".join(str(int(number)) for number in group) for group in (in_run, in_judging, in_report)]
        command = ("run", "short.yaml", "--yes", "--json", "out.json")
        done = subprocess.run(
            [sys.executable, "-c", STRUCK, *numbers, *command],
            cwd=tmp_path, check=False, timeout=300, capture_output=True, text=True, stdin=subprocess.DEVNULL,
        )  # fmt: skip
        (session,) = (path.parent for path in tmp_path.glob("sessions/*/session.json"))
        assert (session / "results.json").is_file(), done.stderr
        results = result_from_dict(json.loads((session / "results.json").read_text()))
        assert result_from_dict(json.loads((tmp_path / "out.json").read_text())) == results
        store = tmp_path / "sessions" / "results.db"
        with sqlite3.connect(store) as rows:
            assert rows.execute("SELECT count(*) FROM runs").fetchall() == [(1,)]
        return done, session, results

    return run


@pytest.mark.parametrize(
    ("first", "further"),
    [
        pytest.param(signal.SIGINT, [signal.SIGTERM], marks=pytest.mark.study),
        (signal.SIGHUP, [signal.SIGHUP, signal.SIGINT, signal.SIGUSR1, signal.SIGQUIT]),
    ],
)
def test_signals_after_the_safe_stop_lose_nothing(struck, first, further):
    done, session, results = struck([first], further, further)
    assert done.returncode == results.exit_code == 5, done.stderr
    assert results.bench.safe_state is True
    assert (session / "report.html").is_file()


def test_an_order_that_comes_late_ends_the_command_and_not_the_verdict(struck):
    done, session, results = struck([], [signal.SIGTERM])
    assert (done.returncode, results.bench.outcome) == (5, "ok")
    assert "aborted: SIGTERM came once the run was over; its results stand" in done.stderr
    assert (session / "report.html").is_file()


def test_who_presses_ctrl_c_again_and_again_need_not_wait_for_the_report(struck):
    done, session, results = struck([signal.SIGINT], [signal.SIGINT], [signal.SIGINT])
    assert done.returncode == results.exit_code == 5, done.stderr
    assert "the report was not written: Ctrl-C" in done.stderr
    assert "ABORTED" in done.stdout
    assert not (session / "report.html").exists()


@pytest.mark.parametrize(("supply", "outcome"), [("10 V, 18 V", "ok"), ("1 V, 2 V", "fault")])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGQUIT])
def test_a_caller_without_signals_hears_what_came_while_the_unit_was_judged(
    tmp_path, monkeypatch, supply, outcome, number
):
    (tmp_path / "short.yaml").write_text(SUPPLIED.format(supply))
    job = prepare(replace(files(), scenario=tmp_path / "short.yaml"))
    judge = Analysis.finish

    def struck(*arguments, **options):
        os.kill(os.getpid(), number)
        return judge(*arguments, **options)

    monkeypatch.setattr(Analysis, "finish", struck)
    before = signal.getsignal(number)
    with pytest.raises(KeyboardInterrupt, match="came once the run was over; its results stand"):
        execute(job, tmp_path, "", 1)
    assert signal.getsignal(number) is before
    (results,) = tmp_path.glob("*/results.json")
    assert json.loads(results.read_text())["bench"]["outcome"] == outcome


def test_only_the_last_exit_puts_the_handlers_back():
    before = signal.getsignal(signal.SIGTERM)
    with StopSignals() as signals:
        with signals:
            signals.hold()
        signals.let_go()
        os.kill(os.getpid(), signal.SIGTERM)
        assert signals.received == "SIGTERM"
    assert signal.getsignal(signal.SIGTERM) is before


ENDING = """
import os, signal, sys, time
from etb_hil.cli.main import main
sys.argv = ["etb-hil", "schema", "nosuch"]
code = main()
os.kill(os.getpid(), getattr(signal, "{name}"))  # while Python ends
time.sleep(0.05)
sys.exit(code)
"""


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_signal_while_the_process_ends_does_not_replace_its_exit_code(name):
    ended = subprocess.run(
        [sys.executable, "-c", ENDING.format(name=name)], capture_output=True, text=True, check=False
    )
    assert (ended.returncode, "Traceback" in ended.stderr) == (2, False)
