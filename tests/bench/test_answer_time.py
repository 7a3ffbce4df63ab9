"""How long the bridge takes to be shown as commanded: when that is too long, and what is said of a whole run."""

import numpy as np
import pytest

from etb_hil.base.modes import Mode
from etb_hil.recording.recording import ClockGrade, Recording
from etb_hil.recording.samples import SampleBlock
from etb_hil.session.answer_time import AnswerWatch, answer_time

MS = 1_000_000
ON, OFF = Mode.POSITION, Mode.OFF


def block(role, values, stamps_ms):
    stamp_ns = np.array([round(stamp * MS) for stamp in stamps_ms], np.int64)
    return SampleBlock(role, stamp_ns, stamp_ns, {role: np.array(values, float)}, np.zeros(len(stamp_ns), np.int64))


def commands(*pairs):
    return block("command_mode", [mode for _, mode in pairs], [stamp for stamp, _ in pairs])


def statuses(*pairs):
    return block("enable", [is_on for _, is_on in pairs], [stamp for stamp, _ in pairs])


def said(*blocks):
    watch = AnswerWatch(20 * MS)
    return [watch.push(one) for one in blocks]


@pytest.mark.parametrize(("mode", "before", "wanted", "still"), [(ON, OFF, "on", "off"), (OFF, ON, "off", "on")])
def test_a_status_that_does_not_show_what_was_commanded_is_late_after_what_is_allowed(mode, before, wanted, still):
    shown, not_shown = float(mode != OFF), float(mode == OFF)
    history = [commands((0, before)), statuses((1, not_shown)), commands((10, mode))]
    assert said(*history, statuses((30, not_shown))) == [None] * 4
    late = f"the bridge is reported {still} 20 ms after it was commanded {wanted} (allowed: 20 ms)"
    assert said(*history, statuses((30.001, not_shown))) == [None, None, None, late]
    assert said(*history, statuses((25, not_shown), (90, not_shown)))[-1] == late.replace("20 ms after", "80 ms after")
    assert said(*history, statuses((500, shown), (501, not_shown), (900, not_shown)))[-1] is None
    assert said(*history, statuses((29, shown)), statuses((31, not_shown))) == [None] * 5


def test_a_status_from_before_the_command_shows_nothing():
    assert said(commands((10, ON)), statuses((9, 1), (10, 1)), statuses((31, 0)))[-1] is not None
    assert said(commands((10, ON)), statuses((9, 1), (10.001, 1)), statuses((31, 0)))[-1] is None


@pytest.mark.parametrize(("mode", "before"), [(ON, OFF), (OFF, ON)])
def test_a_bad_status_shows_nothing(mode, before):
    history = [commands((0, before)), statuses((1, float(before != OFF))), commands((10, mode))]
    assert said(*history, statuses((15, np.nan), (60, np.nan)))[-1] is None
    assert said(*history, statuses((15, np.nan), (60, float(before != OFF))))[-1] is not None


def test_the_time_counts_from_the_command_that_changed_something():
    repeated = [commands((stamp, ON)) for stamp in (10, 15, 20, 25)]
    assert said(commands((0, OFF)), *repeated, statuses((31, 0)))[-1] is not None
    together = commands((0, OFF), (10, ON), (15, ON), (20, OFF), (25, ON), (28, ON))
    assert said(together, statuses((45, 0))) == [None, None]
    assert said(together, statuses((45.001, 0)))[-1] is not None


def test_the_last_command_of_a_block_counts_though_the_first_changes_nothing():
    again = commands((5, OFF), (10, ON))
    assert said(commands((0, OFF)), again, statuses((30.001, 0)))[-1] is not None
    assert said(commands((0, OFF)), again, statuses((30.001, 1)))[-1] is None


def test_before_any_command_a_status_is_not_late():
    assert said(statuses((0, 0), (500, 1), (900, 0))) == [None]


def recorded(asked, shown):
    recording = Recording("test", ClockGrade.RECEIVE_STAMPS)
    recording.append([commands(*asked), statuses(*shown)])
    return answer_time(recording)


@pytest.mark.parametrize(
    ("asked", "shown", "mean", "worst"),
    [
        ([(0, OFF), (10, ON), (100, OFF)], [(5, 0), (13, 1), (90, 1), (107, 0)], 5.0, 7.0),
        ([(0, OFF), (10, ON), (20, ON)], [(5, 0), (11, 0), (14, 1), (15, 1)], 4.0, 4.0),
        ([(0, OFF), (10, ON)], [(5, 0), (10, 1), (15, 1)], None, None),  # shown before it can have been asked
        ([(0, OFF), (10, ON)], [(11, 1)], None, None),  # what was shown before is not known
        ([(0, OFF), (10, ON)], [(5, 1), (15, 1)], None, None),  # it was on all the time
        ([(0, OFF), (10, ON), (20, OFF)], [(5, 0), (20, 1), (25, 0)], 5.0, 5.0),  # on: shown when no longer asked
        ([(0, OFF), (10, ON), (20, OFF)], [(5, 0), (19.5, 1), (25, 0)], 7.25, 9.5),
        ([(0, OFF), (10, ON), (20, OFF)], [(5, 0), (12, 1), (19, 1)], 2.0, 2.0),
        ([(0, ON), (10, ON)], [(5, 0), (15, 1)], None, None),
        ([(0, OFF), (10, Mode.VOLTAGE), (12, ON)], [(5, 0), (18, 1)], 8.0, 8.0),
    ],
)
def test_an_answer_is_the_first_status_that_shows_a_change_while_it_is_asked_for(asked, shown, mean, worst):
    found = recorded(asked, shown)
    assert (found and found.mean_ms, found and found.worst_ms) == (mean, worst)


@pytest.mark.parametrize("only", [commands((0, OFF), (10, ON)), statuses((5, 0), (15, 1))])
def test_without_commands_or_statuses_there_is_no_answer(only):
    recording = Recording("test", ClockGrade.RECEIVE_STAMPS)
    recording.append([only])
    assert answer_time(recording) is None
