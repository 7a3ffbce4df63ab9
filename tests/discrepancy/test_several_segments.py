"""Pieces of a healthy unit's record, wherever they begin, however short: nothing of the unit is accused."""

import numpy as np
import pytest
from answers import plain
from synthetic import MODEL, RATE, measurement

from etb_hil.base.stock import find
from etb_hil.bench.simulation import Simulation
from etb_hil.discrepancy.candidates.nonparametric import in_their_own_balances
from etb_hil.discrepancy.explain import explain
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.fit import Fit
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.recording.recording import ClockGrade, Recording
from etb_hil.recording.samples import SampleBlock
from etb_hil.scenario.scenario_file import load_scenario

ROLES = ("motor_voltage", "motor_current", "motor_angle", "throttle_angle")


@pytest.fixture(scope="module")
def whole():
    steps = load_scenario(find("scenario", "isolability")).content.steps
    return Simulation(MODEL, MODEL, law="pd", seed=3, rate=RATE).run(steps)


def _piece(whole, begin, seconds, **changed):
    time_ns, columns = whole
    samples = slice(round(begin * RATE), round((begin + seconds) * RATE))
    columns = {role: np.array(columns[role][samples]) for role in ROLES}
    for role, change in changed.items():
        columns[role] = change(columns[role])
    found = Recording("piece", ClockGrade.TABLE)
    lost = np.zeros(len(time_ns[samples]), np.int64)
    found.append([SampleBlock("table", time_ns[samples], time_ns[samples], columns, lost)])
    return found


@pytest.mark.parametrize(
    ("begin", "seconds"),
    [
        pytest.param(46.66, 12.0, marks=pytest.mark.study),
        *((46.72, 3.0), (30.0, 3.0), (5.25, 3.0), (2.88, 8.0), (3.98, 12.0)),
    ],
)
def test_what_held_the_plate_before_a_record_is_no_cause(whole, begin, seconds):
    """On a stop, at rest and with few samples in a group: a soft stop, cogging and a dead zone had been seen there."""
    (measured,) = measurements_of(_piece(whole, begin, seconds), MODEL)
    found = search(MODEL, [Balances(measured, MODEL)])
    assert found.verdict == "adequate"
    assert not found.accepted


def test_the_beginning_is_judged_where_it_speaks_against_nobody(whole):
    """From rest at limp-home, as a bench begins, nothing is over its band."""
    (measured,) = measurements_of(_piece(whole, 0.0, 12.0), MODEL)
    balances = Balances(measured, MODEL)
    before = balances.regimes
    assert search(MODEL, [balances]).verdict == "adequate"
    assert balances.regimes is before
    assert (before.after_first_slide().is_stuck & ~before.is_stuck).any()


@pytest.mark.study
def test_a_cause_that_the_beginning_shows_too_is_looked_for_in_all_samples():
    """A break-away that grows with rest shows in the first slide and in the later ones."""
    p = MODEL.vector()
    p[list(CATALOGUE["stiction_dwell"].indices)] = [0.3, 0.1, 0.003]
    balances = Balances(measurement(p, seed=4), MODEL)
    before = balances.regimes
    (found,) = search(MODEL, [balances]).accepted
    assert found.winner.id == "stiction_dwell"
    assert balances.regimes is before


@pytest.mark.parametrize("is_ended", [True, pytest.param(False, marks=pytest.mark.study)])
def test_what_happens_once_in_some_seconds_is_no_cause(whole, is_ended):
    """A wrong resistance in all of the voltage, too short to be told from another cause: also by a whole search."""

    def progress(what):
        if is_ended and what.startswith("looking for a cause"):
            raise KeyboardInterrupt

    recording = _piece(whole, 30.0, 4.0, motor_voltage=lambda volts: 1.3 * volts)
    found = plain(explain([recording], MODEL, progress=progress))
    assert found["verdict"] == "insufficient_data"
    assert not found["causes"]
    assert "at least 10 s are needed to distinguish a cause from a single event" in found["data_quality"][0]


def test_an_angle_that_is_missing_for_long_parts_the_record(whole):
    def missing(angle):
        angle[16000:16400] = np.nan
        angle[100] = np.nan
        return angle

    first, second = measurements_of(_piece(whole, 0.0, 20.0, motor_angle=missing), MODEL)
    assert len(first) == 16000
    assert len(second) == 40000 - 16400
    assert any("of the samples have no motor_angle" in flag for flag in first.flags)


def test_segments_that_rest_for_unlike_long_are_searched_together(whole):
    """Of one that rests for most of its time fewer knots of a nameless spline are apart."""
    segments = [measurements_of(_piece(whole, begin, 3.0), MODEL)[0] for begin in (10.0, 29.0)]
    balances = [Balances(measured, MODEL) for measured in segments]
    count = 3 * sum(b.samples for b in balances)
    found = in_their_own_balances(balances, np.ones((count, 0)), Fit(MODEL.vector(), np.zeros(count), 0.0), [])
    assert {one.explained_share for one in found} == {0.0}
