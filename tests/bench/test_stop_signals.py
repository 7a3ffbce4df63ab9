"""Signals that end a run: which outranks which, when they are noted, and that the handlers are put back."""

import os
import signal
import threading

import pytest

from etb_hil.bench.command_pause import CommandPause
from etb_hil.bench.stop_signals import VERBS, StopSignals, Verb

MS = 1_000_000


def send(*names):
    for name in names:
        os.kill(os.getpid(), getattr(signal, name))


def handlers():
    return {name: signal.getsignal(getattr(signal, name)) for name in VERBS}


@pytest.mark.parametrize(
    ("sent", "verb", "received"),
    [
        (("SIGUSR1",), Verb.STOP, "SIGUSR1"),
        (("SIGINT",), Verb.ABORT, "SIGINT"),
        (("SIGTERM",), Verb.ABORT, "SIGTERM"),
        (("SIGHUP",), Verb.ABORT, "SIGHUP"),
        (("SIGALRM",), Verb.ABORT, "SIGALRM"),
        (("SIGQUIT",), Verb.HALT, "SIGQUIT"),
        (("SIGUSR1", "SIGINT"), Verb.ABORT, "SIGINT"),
        (("SIGINT", "SIGUSR1"), Verb.ABORT, "SIGINT"),
        (("SIGINT", "SIGTERM"), Verb.ABORT, "SIGINT"),  # the first one is the cause
        (("SIGTERM", "SIGQUIT", "SIGUSR1"), Verb.HALT, "SIGQUIT"),
        (("SIGINT",) * 5, Verb.ABORT, "SIGINT"),
    ],
)
def test_a_stronger_order_overrides_a_weaker_one(sent, verb, received):
    with StopSignals() as signals:
        send(*sent)
        assert (signals.verb, signals.received) == (verb, received)


def test_nothing_is_noted_before_and_the_handlers_are_put_back_after():
    before = handlers()
    signals = StopSignals()
    assert (signals.verb, signals.received, signals.cause) == (None, None, None)
    with signals:
        assert set(handlers().values()).isdisjoint(before.values())
        with signals:
            pass
        send("SIGINT")  # still entered
    assert handlers() == before


def test_held_signals_are_noted_until_they_are_let_go():
    before, signals = handlers(), StopSignals()
    signals.let_go()  # nothing was held
    signals.hold()
    signals.hold()  # once is enough
    with signals:
        pass
    send("SIGTERM")
    assert signals.verb is Verb.ABORT
    signals.let_go()
    assert handlers() == before
    signals.let_go()
    with signals:
        assert handlers() != before
    assert handlers() == before


def leave(times):
    with StopSignals() as signals:
        send(*["SIGINT"] * times)
        with signals.leaving():
            send("SIGTERM")
            send("SIGINT")
            return "stayed"


def test_the_third_interrupt_leaves_where_leaving_is_allowed():
    assert leave(1) == "stayed"
    with pytest.raises(KeyboardInterrupt):
        leave(2)
    with StopSignals() as signals:
        with signals.leaving():
            pass
        send(*["SIGINT"] * 5)  # no longer


def test_only_a_further_interrupt_leaves():
    with StopSignals() as signals:
        send(*["SIGINT"] * 3)
        with signals.leaving():
            send("SIGTERM", "SIGQUIT")
            assert signals.verb is Verb.HALT
            with pytest.raises(KeyboardInterrupt):
                send("SIGINT")


@pytest.mark.parametrize(("name", "words"), [("SIGALRM", "the time-out"), ("SIGINT", "Ctrl-C"), ("SIGTERM", "SIGTERM")])
def test_the_cause_is_said_in_words(name, words):
    with StopSignals() as signals:
        send(name)
        assert words in signals.cause


@pytest.mark.parametrize(("name", "is_late"), [("SIGUSR1", False), ("SIGINT", True), ("SIGQUIT", True)])
def test_an_order_that_came_too_late_is_told(name, is_late):
    with StopSignals() as signals:
        signals.raise_if_late()
        send(name)
        if is_late:
            with pytest.raises(KeyboardInterrupt, match="once the run was over"):
                signals.raise_if_late()
        else:
            signals.raise_if_late()


def test_another_thread_changes_no_handler():
    before, seen = handlers(), []

    def enter():
        with StopSignals():
            seen.append(handlers())

    thread = threading.Thread(target=enter)
    thread.start()
    thread.join()
    assert seen == [before]


def paused(*sent_ms, tick_ms=10):
    pause = CommandPause(tick_ms * MS)
    for at in sent_ms:
        pause.note(at * MS)
    return pause.too_long(max(sent_ms, default=0) * MS)


@pytest.mark.parametrize(
    ("sent_ms", "said"),
    [
        ((), None),
        ((5_000,), None),  # the first command has none before it
        ((0, 10, 20), None),
        ((0, 10, 30), None),  # two intervals
        ((0, 10, 31), "21 ms passed without a command; one was due every 10 ms"),
        ((0, 10, 50, 60), "40 ms"),
        ((0, 10, 50, 75), "40 ms"),  # the longest
        ((0, 40, 100), "60 ms"),
        ((0, 40, *range(50, 541, 10)), "40 ms"),  # half a second later it is still told
        ((0, 40, *range(50, 561, 10)), None),  # then no more
        ((0, 40, *range(50, 301, 10), 340, *range(350, 781, 10)), "40 ms"),  # of equal ones the last is told
        ((0, 40, *range(50, 541, 10), 565), "25 ms"),  # forgotten for a shorter one
    ],
)
def test_the_longest_pause_of_the_last_half_second_is_told(sent_ms, said):
    found = paused(*sent_ms)
    assert found is None if said is None else found.startswith(said)


@pytest.mark.parametrize(("now_ms", "said"), [(30, None), (31, "21 ms passed without a command"), (90, "80 ms")])
def test_a_pause_that_goes_on_is_told_before_its_end(now_ms, said):
    """A host that stalls in the wait between two commands hears of the watchdog before it sends the next one."""
    pause = CommandPause(10 * MS)
    for at in (0, 10):
        pause.note(at * MS)
    found = pause.too_long(now_ms * MS)
    assert found is None if said is None else found.startswith(said)


def test_where_nothing_is_sent_on_purpose_no_command_is_late():
    pause = CommandPause(10 * MS)
    pause.note(0)
    pause.rest()
    assert pause.too_long(900 * MS) is None
    pause.note(900 * MS)
    pause.note(910 * MS)
    assert pause.too_long(915 * MS) is None
