"""Stop, abort and halt in lock-step, and the controller's own word on when its drive went off."""

import json
import os
import signal
from functools import partial

import pytest
from faults_study import job_of

from etb_hil.base.errors import BenchFault, RecordingFault
from etb_hil.bench import job as job_room
from etb_hil.bench.job import execute
from etb_hil.bench.stop_signals import StopSignals, Verb
from etb_hil.canio.bus.link import VirtualLink
from etb_hil.canio.bus.virtual_network import VirtualNetwork
from etb_hil.canio.logs.blf import BlfLog
from etb_hil.controller.virtual_controller import VirtualController
from etb_hil.results.json_file import result_from_dict

CAUSE_NS = 2_000_000_000  # on the way to the stops, the drive on
WATCHDOG_MS = 30.0


class Link:
    """A virtual link on which `cause` happens once its time has come; what it returns is done with later frames."""

    def __init__(self, link, clock, cause):
        self._link, self._clock, self._cause = link, clock, cause
        self.struck_ns = None

    def __getattr__(self, name):
        return getattr(self._link, name)

    def receive(self):
        frames = self._link.receive()
        if self._clock.now_ns() >= CAUSE_NS:
            if self.struck_ns is None:
                self.struck_ns = self._clock.now_ns()
            self._cause()
        return frames

    def send(self, frames):
        self._link.send(frames)


@pytest.fixture
def stopped(tmp_path, monkeypatch):
    """Run with a cause in the middle; return results, or what was raised, the cause's time and the drive's switches."""

    def run(cause, link_type=Link):
        switches, links = [], []

        def connect(job, seed):
            bus = job.setup.bench.bus
            network = VirtualNetwork(int(bus.bitrate), int(bus.data_bitrate), fd=bus.fd)
            switch = partial(switches.append)
            network.attach(VirtualController(job.unit, job.setup.dialect, seed, on_switch=switch))
            links.append(link_type(VirtualLink(network), network.clock, cause))
            run.network = network
            return links[0], network.clock

        monkeypatch.setattr(job_room, "connect", connect)
        try:
            outcome = execute(job_of("virtual_classic", "default"), tmp_path, "", 1).results
        except Exception as error:  # noqa: BLE001 (handed to the test)
            outcome = error
        run.network.sleep_until_ns(run.network.now_ns() + 100_000_000)
        last = switches[-1]
        assert not last.on
        return outcome, links[0].struck_ns, last

    return run


def once(number):
    sent = []

    def cause():
        if not sent:
            sent.append(os.kill(os.getpid(), number))

    return cause


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_an_abort_takes_the_drive_off_within_a_tick(stopped, name):
    results, cause_ns, off = stopped(once(getattr(signal, name)))
    assert (results.bench.outcome, results.bench.safe_state, results.exit_code) == ("aborted", True, 5)
    assert (name if name != "SIGINT" else "Ctrl-C") in results.bench.reason
    assert off.reason == "command"
    assert off.stamp_ns - cause_ns <= 20_000_000


def test_further_signals_do_not_cut_the_safe_stop_short(stopped):
    results, cause_ns, off = stopped(lambda: os.kill(os.getpid(), signal.SIGINT))  # at every look from now on
    assert (results.bench.outcome, results.bench.safe_state) == ("aborted", True)
    assert off.stamp_ns - cause_ns <= 20_000_000


def test_a_stop_in_order_leads_the_plate_home_first(stopped):
    results, cause_ns, off = stopped(once(signal.SIGUSR1))
    assert (results.bench.outcome, results.bench.safe_state, results.exit_code) == ("aborted", True, 5)
    assert off.reason == "command"
    assert 0.05e9 < off.stamp_ns - cause_ns < 2.5e9


def test_an_abort_overrides_a_stop_in_order(stopped):
    signals = iter([signal.SIGUSR1, signal.SIGINT])

    def cause():
        if (number := next(signals, None)) is not None:
            os.kill(os.getpid(), number)

    results, cause_ns, off = stopped(cause)
    assert "Ctrl-C" in results.bench.reason
    assert off.stamp_ns - cause_ns <= 40_000_000


def test_a_halt_leaves_it_to_the_watchdog(stopped):
    results, _, off = stopped(once(signal.SIGQUIT))
    assert (results.bench.outcome, results.bench.safe_state) == ("aborted", True)
    assert off.reason == "timeout"
    assert (off.stamp_ns - off.last_command_ns) * 1e-6 <= WATCHDOG_MS


def test_a_bus_that_goes_away_is_off_by_the_watchdog(stopped):
    def gone():
        raise BenchFault("the bus is gone")

    class Gone(Link):
        def send(self, frames):
            if self.struck_ns is not None:
                gone()
            super().send(frames)

    results, _, off = stopped(gone, Gone)
    assert (results.bench.reason_id, results.bench.safe_state, results.exit_code) == (
        "bus_fault", False, 3,
    )  # fmt: skip
    assert (off.stamp_ns - off.last_command_ns) * 1e-6 <= WATCHDOG_MS


@pytest.mark.spoilt
def test_a_host_that_stalls_is_named_and_not_the_controller(stopped):
    def stall():
        if not stalls:
            stalls.append(1)
            stopped.network.sleep_until_ns(stopped.network.now_ns() + 50_000_000)

    stalls = []
    results, _, off = stopped(stall)
    assert (results.bench.reason_id, results.exit_code) == ("host_late", 3)
    assert "60 ms passed without a command; one was due every 10 ms" in results.bench.reason
    assert off.reason == "timeout"
    assert (off.stamp_ns - off.last_command_ns) * 1e-6 <= WATCHDOG_MS


def test_commands_that_get_lost_are_not_blamed_on_the_host(stopped):
    class Deaf(Link):
        def send(self, frames):
            if self.struck_ns is None:
                super().send(frames)

    results, _, off = stopped(lambda: None, Deaf)
    assert results.bench.reason_id == "controller_fault"
    assert off.reason == "timeout"


@pytest.mark.parametrize("error", [ZeroDivisionError, MemoryError, KeyError, RecursionError])
def test_an_exception_in_any_room_takes_the_drive_off(stopped, error):
    def cause():
        if not struck:
            struck.append(1)
            raise error("a bug")

    struck = []
    outcome, cause_ns, off = stopped(cause)
    assert isinstance(outcome, error)
    assert off.reason == "command"
    assert off.stamp_ns - cause_ns <= 20_000_000


@pytest.mark.parametrize("which", ["write", "flush"])
def test_a_full_disk_takes_the_drive_off_and_is_seen_to_be_off(stopped, monkeypatch, tmp_path, which):
    ok = getattr(BlfLog, which)
    since, failed = [], []

    def full(self, *arguments):
        if since:
            failed.append(stopped.network.now_ns())
            raise RecordingFault("raw.blf: the raw log cannot be written: No space left on device")
        return ok(self, *arguments)

    monkeypatch.setattr(BlfLog, which, full)
    outcome, _, off = stopped(lambda: since.append(1))
    (session,) = (path.parent for path in tmp_path.glob("*/results.json"))
    bench = result_from_dict(json.loads((session / "results.json").read_text())).bench
    assert (bench.reason_id, bench.safe_state) == ("not_recorded", True)
    assert isinstance(outcome, RecordingFault) or outcome.exit_code == 3
    assert off.reason == "command"
    assert off.stamp_ns - failed[0] <= 20_000_000


def test_a_higher_verb_overrides_a_lower_one_and_handlers_are_put_back():
    before = signal.getsignal(signal.SIGINT)
    with StopSignals() as signals:
        os.kill(os.getpid(), signal.SIGUSR1)
        assert (signals.verb, signals.received) == (Verb.STOP, "SIGUSR1")
        os.kill(os.getpid(), signal.SIGTERM)
        os.kill(os.getpid(), signal.SIGINT)
        assert (signals.verb, signals.received) == (Verb.ABORT, "SIGTERM")
    assert signal.getsignal(signal.SIGINT) is before
