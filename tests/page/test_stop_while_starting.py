"""STOP and "end in order" reach a run at any time: before it has begun, and once it is over."""

import argparse
import os
import signal

import pytest
from report import sample_run
from served import until
from test_page_lets_nobody_in import take, told

from etb_hil.base.outcome import ExitCode
from etb_hil.cli.page_screen import run_for_page
from etb_hil.cli.units import Judged
from etb_hil.page.channel import Channel


@pytest.fixture
def handlers():
    """Put the handlers of signals back, which a run's own process need not do."""
    numbers = [getattr(signal, name) for name in ("SIGINT", "SIGUSR1", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGALRM")]
    before = [(number, signal.getsignal(number)) for number in numbers]
    yield
    for number, handler in before:
        signal.signal(number, handler)


@pytest.mark.parametrize("path", ["/api/stop", "/api/end"])
def test_a_test_that_is_starting_is_aborted_before_the_plate_moves(page, path):
    cookie = take(page)
    number = told(page, cookie)["number"]
    assert page.ask("POST", "/api/start", {"serial": "OK-1"}, cookie)[0] == 200
    assert page.ask("POST", path, {}, cookie)[0] == 200
    about = until(lambda: (now := told(page, cookie))["status"] == "done" and now)
    outcome = about["outcome"]
    assert about["number"] == number + 1
    assert (outcome["headline"], outcome["reason"]) == (
        "ABORTED",
        "The operator stopped the run before the plate moved.",
    )
    assert outcome["session"] == ""
    page.ask("POST", "/api/release", {}, cookie)


@pytest.mark.usefixtures("handlers")
@pytest.mark.parametrize("pressed", [signal.SIGUSR1, signal.SIGINT])
def test_a_press_that_comes_after_the_run_costs_no_verdict(tmp_path, pressed):
    class Units:
        def check(self, serial):
            return serial

        def run(self, serial, held):
            assert serial == "OK-1"
            held.hold()  # as a run does
            os.kill(os.getpid(), pressed)
            return Judged(sample_run.results(), ExitCode.DONE)

    options = argparse.Namespace(page=tmp_path, serial="OK-1", operator="A")
    assert run_for_page(Units, options) == ExitCode.DONE
    outcome = Channel(tmp_path).read_state()["outcome"]
    assert outcome["headline"] == "PASS"
    assert "STOP came after the run had ended. The verdict stands." in outcome["further"]


@pytest.mark.usefixtures("handlers")
def test_a_press_before_the_run_ends_it_and_is_told(tmp_path):
    def never():
        os.kill(os.getpid(), signal.SIGUSR1)
        raise AssertionError("the run went on")

    options = argparse.Namespace(page=tmp_path, serial="OK-1", operator="A")
    with pytest.raises(KeyboardInterrupt):
        run_for_page(never, options)
    outcome = Channel(tmp_path).read_state()["outcome"]
    assert (outcome["headline"], outcome["next_step"]) == ("ABORTED", "Repeat the test.")
