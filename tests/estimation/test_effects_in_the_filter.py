"""A throttle with an effect, simulated in steps of 50 us: with the effect the filter needs no disturbance for it."""

from dataclasses import replace

import numpy as np
import pytest
from driven_plant import driven

from etb_hil.base.stock import find
from etb_hil.estimation.filtering import Column, Disturbance, filtered, sensitivities
from etb_hil.estimation.throttle import OMEGA
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.parameters import load_model
from etb_hil.plant.physics import (
    COULOMB,
    DEAD_ZONE,
    LIMP_HOME,
    PRELOAD_CLOSE,
    PRELOAD_OPEN,
    SLOPE_OPEN,
    STICTION,
    STOP_LOW,
)

MODEL = load_model(find("model", "default"))
SMALL, LARGE = Disturbance(1e-4, 1e-3), Disturbance(1e-2, 1e-1)


def _with(id_, **strengths):
    p = MODEL.vector()
    for name, value in strengths.items():
        p[CATALOGUE[id_].place(name)] = value
    return p


@pytest.mark.parametrize("rate", [1000, 2000])
@pytest.mark.parametrize(
    ("id_", "strengths"),
    [
        ("cogging_torque", {"sine": 0.03, "order": 12.0}),
        ("torque_ripple", {"sine": 0.15, "order": 10.0, "share_in_back_emf": 1.0}),
        ("hbridge_dead_time", {"error": 0.4, "ripple_current": 0.2, "sharpness": 4.0}),
    ],
)
def test_what_changes_within_a_sample_is_followed(id_, strengths, rate):
    """A wave over the motor's turn goes through radians in a sample; the filter is not locked out by it."""
    p = _with(id_, **strengths)
    seen, truth = driven(MODEL, p, rate)
    with_it, without = filtered(seen, p, SMALL), filtered(seen, MODEL.vector(), LARGE)
    assert np.std(with_it.states[200:, OMEGA] - truth[200:, 1]) < 0.01 * np.std(truth[200:, 1])
    assert with_it.rescued == 0
    assert with_it.log_likelihood > without.log_likelihood + 1000.0


@pytest.mark.parametrize("late", [0.2e-3, 0.5e-3, 1.6e-3, 6.3e-3])
def test_a_current_that_comes_late_is_one_of_an_earlier_sample(late):
    """The lateness that the data have is likelier than a shorter and a longer one, beyond a sample too."""
    seen, _ = driven(MODEL, MODEL.vector(), 1000, late=late)
    shorter, true, longer = (
        filtered(seen, _with("measurement_delay", delay=by * late), SMALL).log_likelihood for by in (0.8, 1.0, 1.25)
    )
    assert true > max(shorter, longer) + 25.0
    assert true > filtered(seen, MODEL.vector(), LARGE).log_likelihood + 1000.0


@pytest.mark.parametrize("rate", [1000, 2000])
def test_a_capacitor_that_holds_nothing_is_none(rate):
    """What follows within a sample is no sample late: the voltage of the bridge changes at once."""
    p = _with("supply_sag", source_resistance=0.3)
    seen, _ = driven(MODEL, p, rate)
    none, empty = (
        filtered(seen, _with("supply_sag", source_resistance=0.3, time_constant=one), SMALL).log_likelihood
        for one in (0.0, 1e-6)
    )
    without = filtered(seen, MODEL.vector(), SMALL).log_likelihood
    assert abs(empty - none) < 0.0025 * (none - without)


LATE = ("measurement_delay", "angle_delay", "motor_angle_delay", "plate_angle_delay")


# Each channel with one lag here, and one at the higher rate; all of them every night.
LAGS = {
    ("measurement_delay", 2.2e-3, 1000), ("angle_delay", 1e-3, 1000), ("motor_angle_delay", 6e-3, 1000),
    ("plate_angle_delay", 2.2e-3, 1000), ("measurement_delay", 1e-3, 2000),
}  # fmt: skip


@pytest.mark.parametrize(
    ("id_", "delay", "lag", "rate"),
    [
        pytest.param(id_, delay, lag, rate, marks=[] if (id_, lag, rate) in LAGS else pytest.mark.study)
        for id_ in LATE
        for delay, lag in ((0.0, 1e-3), (0.0, 2.2e-3), (1.3e-3, 6e-3))
        for rate in (1000, 2000)
    ],
)
def test_behind_a_lag_no_other_lag_is_as_likely(rate, id_, delay, lag):
    """A current keeps its noise; the noise of an angle is that of a data sheet, more than what it has here."""
    p = _with(id_, delay=delay, lag=lag)
    seen, _ = driven(MODEL, p, rate)
    others = [_with(id_, delay=delay, lag=by * lag) for by in (0.8, 1.25)]
    shorter, longer = (filtered(seen, other, SMALL).log_likelihood for other in others)
    found = filtered(seen, p, SMALL)
    if id_ == "measurement_delay":
        assert np.std(found.whitened[:, 0]) == pytest.approx(1.0, abs=0.25)
    assert found.log_likelihood > max(shorter, longer) + 25.0
    assert found.log_likelihood > filtered(seen, _with(id_, delay=delay + lag), SMALL).log_likelihood


@pytest.mark.parametrize("id_", LATE[1:])
@pytest.mark.parametrize("late", [0.1e-3, pytest.param(0.5e-3, marks=pytest.mark.study), 3.3e-3])
def test_an_angle_that_comes_late_is_one_of_an_earlier_sample(id_, late):
    """Of 2 samples and more as of a tenth of one, the true delay is the likeliest, and moves nothing else."""
    p = _with(id_, delay=late)
    seen, truth = driven(MODEL, p, 1000)
    shorter, true, longer = (filtered(seen, _with(id_, delay=by * late), SMALL) for by in (0.8, 1.0, 1.25))
    assert true.log_likelihood > max(shorter.log_likelihood, longer.log_likelihood) + 25.0
    assert np.std(true.states[200:, OMEGA] - truth[200:, 1]) < 0.01 * np.std(truth[200:, 1])


def test_a_winding_warms_in_the_time_that_a_thinned_record_leaves_out():
    """With its heat forgotten where a part begins, the winding would be cold there."""
    p = _with("resistance_temperature", self_heating=5.0, time_constant=4.0)
    seen, _ = driven(MODEL, p, 1000, seconds=20.0)
    thinned = seen.thinned(4000, 8)
    cold = replace(thinned, since=np.where(thinned.since > 0.0, np.inf, 0.0))
    kept, forgotten = (filtered(one, p, LARGE) for one in (thinned, cold))
    assert kept.log_likelihood > forgotten.log_likelihood + 100.0
    assert kept.needed[1] < 0.3 * forgotten.needed[1]


LOOSE = {"compliance": 0.016, "stiffening": 2.0}


@pytest.fixture(scope="module")
def loose():
    """Return the parameters of a throttle with a shaft that gives way, and its record."""
    p = _with("shaft_compliance", **LOOSE)
    return p, driven(MODEL, p, 2000)[0]


@pytest.mark.parametrize(
    ("name", "place"),
    [
        ("limp_home", LIMP_HOME),
        ("dead_zone", DEAD_ZONE),
        ("preload_open", PRELOAD_OPEN),
        ("preload_close", PRELOAD_CLOSE),
        ("slope_open", SLOPE_OPEN),
    ],
)
def test_springs_that_twist_a_shaft_have_the_slopes_that_differences_show(loose, name, place):
    """They move the plate behind the shaft, too, and not only the torque on the motor."""
    p, seen = loose
    assert _error_of_slope(seen, p, Column(name, 1e-3 * MODEL.tolerance(name), place), 2) < 0.1


@pytest.mark.parametrize(
    ("id_", "strengths"),
    [
        ("friction_position_local", {"peak": 0.12, "place": 0.7, "width": 0.2, "steepness": 2.0}),
        ("friction_load", {"coefficient": 0.2, "exponent": 1.0, "friction_share": 0.5}),
        ("friction_asymmetry", {"friction": 0.2, "fade": 0.04, "one_sided": 1.0}),
    ],
)
@pytest.mark.parametrize(("name", "place"), [("coulomb", COULOMB), ("stiction", STICTION)])
def test_friction_that_an_effect_takes_a_share_of_has_the_slope_that_differences_show(id_, strengths, name, place):
    p = _with(id_, **strengths)
    seen, _ = driven(MODEL, p, 2000)
    assert _error_of_slope(seen, p, Column(name, 1e-3 * MODEL.tolerance(name), place), 1) < 0.2


def _error_of_slope(seen, p, column, channel):
    """Return the error of a sensitivity against a difference, as a share of it, in one reading."""
    found = sensitivities(seen, filtered(seen, p, SMALL, is_kept=True), [column], is_kept=True).rows[200:, channel, 0]
    ends = []
    for way in (-1.0, 1.0):
        moved = p.copy()
        moved[column.place] += way * column.step
        ends.append(filtered(seen, moved, SMALL).whitened[200:, channel])
    difference = (ends[1] - ends[0]) / (2.0 * column.step)
    return np.linalg.norm(found - difference) / np.linalg.norm(difference)


@pytest.mark.study
def test_a_stop_that_is_met_somewhat_earlier_is_somewhat_less_likely(loose):
    """A damped stop takes the load of its velocity at once; the likelihood has no jump where a sample comes near."""
    p, seen = loose
    likelihoods = []
    for k in range(200):
        moved = p.copy()
        moved[STOP_LOW] += 1e-7 * k
        likelihoods.append(filtered(seen, moved, SMALL).log_likelihood)
    assert np.max(np.abs(np.diff(likelihoods))) < 2.0
