"""The filter of the whole throttle against the independent one: likelihood, whiteness, coverage, sensitivities."""

from dataclasses import replace

import numpy as np
import pytest
from driven_plant import driven
from estimation_core import SMALLER, columns, late, moved, off
from independent_throttle import Unit, friction_check, off_by_tolerances
from throttle_as_model import parameters, record_until_the_bridge_opens

from etb_hil.base.errors import InputError
from etb_hil.base.stock import find
from etb_hil.estimation.calibration import calibrated
from etb_hil.estimation.filtering import Column, Disturbance, filtered, sensitivities, smoothed
from etb_hil.estimation.forces import LEVEL
from etb_hil.estimation.prior import best_step, log_prior
from etb_hil.estimation.record import Term, joined, record
from etb_hil.estimation.throttle import BRISTLE, CURRENT, OMEGA, THETA
from etb_hil.estimation.unknown import Unknown, base_unknowns
from etb_hil.hypotheses.constants import KNOTS
from etb_hil.hypotheses.terms import BENCH, Drift, drift_unknowns, with_room, with_terms
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.parameters import load_model
from etb_hil.plant.physics import (
    COULOMB,
    GEAR_RATIO,
    LIMP_HOME,
    PRELOAD_OPEN,
    RESISTANCE,
    SLOPE_OPEN,
    STICTION,
    TORQUE_PER_AMPERE,
    VISCOUS,
    stribeck,
)

RATE = 2000
# Of these the filter's gains follow so much that a difference of two passes is another (`estimation_core.py`).
BENDING_GAINS = {"inductance", "limp_home", "limp_home_dead_zone", "angle_delay", "measurement_delay"}
SMALL = Disturbance(1e-3, 1e-2)
TORQUES = (
    "torque_per_ampere", "inertia", "preload_open", "preload_close", "slope_open", "slope_close", "stop_stiffness",
    "stop_damping", "coulomb", "stiction", "bristle_stiffness", "bristle_damping", "viscous",
)  # fmt: skip


def _record(unit, bench, seed):
    """Return a record of a friction check until the bridge opens, its model, and the truth at its samples."""
    motion = truth, phases = friction_check(unit, creeps=(), speeds=(1.6,), dashes=1)
    made, model = record_until_the_bridge_opens(unit, bench, motion, RATE, seed)
    at = slice(0, phases[-1][1], 20000 // RATE)
    return made, model, np.column_stack([truth.angle[at], truth.velocity[at]])


@pytest.fixture(scope="module")
def healthy():
    return _record(Unit(), Unit(), 51)


@pytest.fixture(scope="module")
def fitted():
    """Calibrate a unit that differs from the bench's idea of it within tolerances."""
    made, model, _ = _record(Unit(), off_by_tolerances(Unit(), np.random.default_rng(52)), 52)
    return made, model, calibrated(made, model.vector(), base_unknowns(model))


def _true_vector(model, unit):
    p, true = model.vector(), parameters(unit).vector()
    p[: VISCOUS + 1] = true[: VISCOUS + 1]
    return p


def test_states_of_a_healthy_record_are_true(healthy):
    made, model, truth = healthy
    found = filtered(made, model.vector(), SMALL)
    assert np.std(found.states[200:, THETA] - truth[200:, 0]) < 1e-5
    assert np.std(found.states[200:, OMEGA] - truth[200:, 1]) < 0.01


def test_innovations_at_the_true_parameters_are_white(healthy):
    """No larger than the data sheet's noise, and hardly correlated from sample to sample."""
    made, model, _ = healthy
    found = filtered(made, model.vector(), Disturbance(1e-5, 3e-4))
    w = found.whitened[200:]
    assert found.rescued == 0
    assert np.all(np.mean(w**2, axis=0) < 1.1)
    assert np.all(np.abs(np.mean(w[1:] * w[:-1], axis=0)) < 0.15)


def test_the_likelihood_is_largest_near_the_truth(healthy):
    made, model, _ = healthy
    at_truth = filtered(made, model.vector(), SMALL).log_likelihood
    for place in (COULOMB, VISCOUS):
        for share in (0.9, 1.1):
            p = model.vector()
            p[place] *= share
            assert filtered(made, p, SMALL).log_likelihood < at_truth


def test_calibration_finds_the_true_parameters_within_their_intervals(fitted):
    """Every parameter within three standard deviations, nine of ten within two."""
    _, model, fit = fitted
    true = _true_vector(model, Unit())
    deviation = np.sqrt(np.diag(fit.covariance))
    away = np.array([fit.parameters[one.place] - true[one.place] for one in fit.unknowns]) / deviation
    assert np.max(np.abs(away)) < 3.0
    assert np.mean(np.abs(away) < 2.0) >= 0.9


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_the_interval_of_the_inductance_knows_of_noise_on_the_voltage(healthy, noise):
    """What is read with noise makes a winding look slower, by more than the samples' scatter."""
    made, model, _ = healthy
    read = made.voltage + noise * np.random.default_rng(56).standard_normal(len(made))
    fit = calibrated(replace(made, voltage=read), model.vector(), base_unknowns(model))
    value, deviation = fit.value("inductance")
    assert abs(value - Unit().inductance) < 2.0 * deviation
    assert deviation < (0.1 if noise else 0.03) * Unit().inductance


def test_a_calibrated_healthy_record_needs_no_disturbance(fitted):
    """It ends where the truth does: below 0.1 % of the friction, and no less likely."""
    made, model, fit = fitted
    torque, voltage = fit.filtered.needed
    assert torque < 1e-3 * Unit().coulomb
    assert voltage < 1e-3
    true = filtered(made, _true_vector(model, Unit()), fit.disturbance)
    assert fit.filtered.log_likelihood > true.log_likelihood - 10.0


def test_a_data_sheet_that_states_twice_the_noise_is_corrected(fitted):
    """The stock model states 20 mV of voltage noise, the independent throttle has 10 mV; steps are 10 mV in both."""
    made, _, fit = fitted
    steps = 10.0**2 / 12.0
    true = (10.0**2 + steps) / (20.0**2 + steps)
    assert fit.disturbance.noise.voltage == pytest.approx(true, rel=0.25)
    assert max(fit.disturbance.noise[:3]) < 1.0 + 3.0 * np.sqrt(2.0 / len(made))  # as sure as so many samples are
    assert np.mean(fit.filtered.whitened[200:, 0] ** 2) == pytest.approx(1.0, abs=0.2)


def test_the_jitter_of_the_clock_is_found():
    """Angles are read 4 us (rms) off their stamps, where 1 us is supposed."""
    made, model, truth = _record(Unit(), Unit(), 55)
    late = np.random.default_rng(55).normal(0.0, 4e-6, len(made))
    readings = made.readings + np.outer(late * truth[:, 1], [0.0, 1.0, 1.0])
    fit = calibrated(replace(made, readings=readings), model.vector(), base_unknowns(model))
    assert np.sqrt(fit.disturbance.noise.jitter) == pytest.approx(4.0, rel=0.25)


def test_what_tolerances_cannot_hide_stays_visible():
    """An inertia that is 30 % off is not swallowed by a prior alone."""
    made, model, _ = _record(Unit(), replace(Unit(), inertia=0.7 * Unit().inertia), 53)
    fit = calibrated(made, model.vector(), base_unknowns(model))
    value, _ = fit.value("inertia")
    assert value < 0.85 * Unit().inertia
    assert fit.filtered.needed[0] > 0.01 * Unit().coulomb


COLUMNS = columns(load_model(find("model", "default")))


@pytest.mark.parametrize("asked", COLUMNS, ids=[column.name for _, column, _ in COLUMNS])
def test_sensitivities_are_differences_at_fixed_gains(healthy, asked):
    """To each base parameter and to each effect's first strength; of stops and heat a friction check shows nothing."""
    made, _, _ = healthy
    p, column, ends = asked
    seen = late(made, column.effect) if column.effect else made
    at = filtered(seen, p, SMALL, is_kept=True)
    row = sensitivities(seen, at, [column], is_kept=True).rows[:, :, 0]
    at_fixed_gains, following = off(seen, at, row, moved(p, column), ends, column.step) or (0.0, 0.0)
    assert at_fixed_gains < 0.02
    if column.name not in BENDING_GAINS:
        assert following < 0.02


def test_sensitivities_to_stops_are_differences_at_fixed_gains():
    """In a record that meets both, away from where a sample begins to meet one: there the torque jumps."""
    model = load_model(find("model", "default"))
    p = model.vector()
    made, _ = driven(model, p, RATE)
    at = filtered(made, p, SMALL, is_kept=True)
    unknowns = [one for one in base_unknowns(model) if one.name.startswith("stop_")]
    asked = [replace(one.column(), step=SMALLER * one.column().step) for one in unknowns]
    rows = sensitivities(made, at, asked, is_kept=True).rows
    errors = [off(made, at, rows[..., k], moved(p, one), (-1.0, 1.0), one.step)[0] for k, one in enumerate(asked)]
    assert len(errors) == 4
    assert max(errors) < 0.02


def test_interference_is_survived(healthy):
    """After bursts of wrong readings the states are true again within 50 ms, and bristles were never wound up."""
    made, model, truth = healthy
    readings = made.readings.copy()
    readings[4000:4010, 1:] += 0.5
    readings[6000, 0] = 30.0
    p = model.vector()
    found = filtered(replace(made, readings=readings), p, SMALL)
    assert np.all(np.isfinite(found.states))
    for end in (4010 + 100, 6000 + 100):
        assert np.max(np.abs(found.states[end : end + 200, THETA] - truth[end : end + 200, 0])) < 1e-4
    bent = [abs(x[BRISTLE]) / stribeck(x[OMEGA], p) for x in found.states]
    assert max(bent) <= 1.2 + 1e-9


def test_a_motion_that_goes_on_elsewhere_is_taken_up_afresh(healthy):
    """Where the unit was moved between two samples, the filter needs no disturbance to follow it."""
    made, model, truth = healthy
    there = int(np.argmax(np.abs(truth[:, 0] - truth[4000, 0])))
    parts = [made.part(slice(0, 4000)), made.part(slice(there, None))]
    seamless = replace(joined(parts), since=np.where(np.arange(4000 + len(parts[1])) == 0, np.inf, 0.0))
    found = filtered(seamless, model.vector(), SMALL)
    assert found.rescued == 1
    assert np.max(np.abs(found.states[4100:, THETA] - truth[there + 100 :, 0])) < 1e-4
    assert found.needed[0] < 0.01 * Unit().coulomb


def test_a_plate_that_rests_is_not_pushed_by_the_rounding_of_its_angle(healthy):
    """The encoder shows one number for 4 s, with an error of nearly half a step."""
    _, model, _ = healthy
    p, n = model.vector(), 4 * RATE
    angle = p[LIMP_HOME] + 0.3
    current = (p[PRELOAD_OPEN] + 0.3 * p[SLOPE_OPEN]) / p[TORQUE_PER_AMPERE]
    step = 2.0 * np.pi / model.sensors.motor_counts_per_turn / p[GEAR_RATIO]
    for error in (-0.45, 0.45):
        shown = np.full(n, angle + error * step)
        volts = np.full(n, current * p[RESISTANCE])
        at_rest = record(np.arange(n) / RATE, volts, model, current=np.full(n, current), motor=shown)
        found = filtered(at_rest, p, SMALL)
        assert np.all(np.isfinite(found.states))
        assert np.abs(found.states[-1000:, OMEGA]).max() < 1e-3
        assert abs(found.states[-1, BRISTLE]) < 0.05 * p[COULOMB]


def test_segments_know_nothing_of_each_other(healthy):
    made, model, _ = healthy
    effect = CATALOGUE["friction_load"]
    columns = [Column("coulomb", 1e-5, COULOMB), Column("effect", 1e-4, effect.indices[0], effect)]
    parts = [made.part(slice(2000, 5000)), made.part(slice(6000, 8000))]
    apart = [filtered(one, model.vector(), SMALL, is_kept=True) for one in parts]
    together = filtered(joined(parts), model.vector(), SMALL, is_kept=True)
    assert together.log_likelihood == pytest.approx(sum(one.log_likelihood for one in apart), abs=1e-6)
    each = [sensitivities(one, at, columns).matrix for one, at in zip(parts, apart, strict=True)]
    assert np.allclose(sensitivities(joined(parts), together, columns).matrix, sum(each), rtol=1e-6)


def test_a_long_record_is_thinned_to_parts_along_all_of_it(healthy):
    made, _, _ = healthy
    some = made.thinned(2000, 4)
    assert len(some) == 2000
    assert np.flatnonzero(some.since).tolist() == [0, 500, 1000, 1500]
    assert (some.readings[0] == made.readings[0]).all()
    assert (some.readings[-1] == made.readings[-1]).all()
    assert made.thinned(len(made), 4) is made


def test_a_record_is_as_likely_where_all_torques_and_the_motors_are_larger(healthy):
    """It shows torques by their currents alone: nothing tells how large they are together."""
    made, model, _ = healthy
    place = {one.name: one.place for one in base_unknowns(model)}
    p = model.vector()
    larger = p.copy()
    larger[[place[name] for name in TORQUES]] *= 1.2
    likely = filtered(made, p, SMALL).log_likelihood
    again = filtered(made, larger, replace(SMALL, torque=1.2 * SMALL.torque)).log_likelihood
    assert again == pytest.approx(likely, abs=0.1)  # nats


def test_a_thinned_record_keeps_its_terms(healthy):
    made, model, _ = healthy
    some = with_terms(made).thinned(2000, 4)
    shapes = np.array([one.shape for one in some.terms])
    assert shapes.shape == (len(BENCH) + KNOTS, 2000)
    assert np.allclose(shapes[len(BENCH) :].sum(axis=0), 0.0)  # a drift that is the same at all knots is none
    p = with_room(model.vector())
    at, column = filtered(some, p, SMALL, is_kept=True), drift_unknowns()[-1].column()
    assert sensitivities(some, at, [column]).matrix[0, 0] > 0.0


def test_a_thinned_record_knows_how_long_was_left_out_and_what_current_flowed(healthy):
    made, _, _ = healthy
    some = made.thinned(2000, 4)
    begins = int(np.argmin(np.abs(made.time - (made.time[499] + some.since[500]))))
    assert np.isinf(some.since[0])
    assert (made.readings[begins] == some.readings[500]).all()
    assert some.heat[500] == pytest.approx(np.mean(made.readings[499:begins, 0] ** 2), rel=1e-3)


def test_readings_may_be_missing(healthy):
    """Without the current, or without the encoder, the motion is still found."""
    made, model, truth = healthy
    for missing in (0, 1):
        readings = made.readings.copy()
        readings[:, missing] = np.nan
        found = filtered(replace(made, readings=readings), model.vector(), SMALL)
        assert np.std(found.states[200:, OMEGA] - truth[200:, 1]) < 0.1
        assert np.all(found.roots[:, missing] == 0.0)


def test_the_smoother_is_nearer_to_the_truth(healthy):
    made, model, truth = healthy
    once, twice = filtered(made, model.vector(), SMALL).states, smoothed(made, model.vector(), SMALL)
    errors = [np.std(states[200:-200, OMEGA] - truth[200:-200, 1]) for states in (once, twice)]
    assert errors[1] < 0.7 * errors[0]
    assert np.all(np.isfinite(twice[:, CURRENT]))


def test_a_state_that_begins_afresh_tells_the_smoother_nothing_of_those_before(healthy):
    """While an angle is read wrong, states begin afresh; carried back over that, errors would grow without end."""
    made, model, truth = healthy
    at = len(made.readings) // 2
    wrong = made.readings.copy()
    wrong[at : at + 40, 1:] += 0.3
    found = smoothed(replace(made, readings=wrong), model.vector(), SMALL)
    for right in (slice(200, at), slice(at + 100, -200)):
        assert np.max(np.abs(found[right, THETA] - truth[right, 0])) < 1e-4
        assert np.std(found[right, OMEGA] - truth[right, 1]) < 0.01


def test_the_smoother_stays_with_the_truth_where_nothing_is_read(healthy):
    """Bristles relax within milliseconds: backwards, that is a growth which rounding errors must not follow."""
    made, model, truth = healthy
    at = slice(len(made.readings) // 2, len(made.readings) // 2 + 400)
    unread = made.readings.copy()
    unread[at] = np.nan
    for disturbance in (SMALL, Disturbance(0.1, 10.0)):
        found = smoothed(replace(made, readings=unread), model.vector(), disturbance)
        off = np.abs(found[:, THETA] - truth[:, 0])
        assert off[at].max() < 0.01 * np.ptp(truth[at, 0])
        assert max(off[200 : at.start].max(), off[at.stop + 10 : -200].max()) < 1e-4


def test_a_record_without_an_angle_or_with_a_clock_that_stands_is_refused(healthy):
    _, model, _ = healthy
    time, volts = np.arange(10) * 5e-4, np.zeros(10)
    with pytest.raises(InputError, match="angle"):
        record(time, volts, model, current=volts)
    assert len(record(time, volts, model, motor=np.full(10, np.nan), plate=volts)) == 10
    with pytest.raises(InputError, match="grow"):
        record(np.zeros(10), volts, model, motor=volts)


def test_a_step_ends_at_the_largest_posterior_of_a_linear_model():
    """Walls and bounds included, wherever the step begins."""
    draws = np.random.default_rng(7)
    unknowns = [Unknown(str(k), k, 1.0, 0.1, reach=0.2, low=0.5 if k % 2 else -np.inf, high=1.3) for k in range(8)]
    for _ in range(20):
        root, start = draws.normal(size=(8, 8)) * 30.0, draws.uniform(0.7, 1.25, 8)
        matrix, gradient = root @ root.T, draws.normal(size=8) * 300.0

        def posterior(p, start=start, matrix=matrix, gradient=gradient):
            way = p - start
            return -gradient @ way - 0.5 * way @ matrix @ way + log_prior(p, unknowns)

        step, gain = best_step(start, unknowns, matrix, gradient, farthest=np.inf)
        end = start + 0.1 * step
        assert gain == pytest.approx(posterior(end) - posterior(start), abs=0.01)
        assert np.all(end < 1.3 + 1e-3)
        tried = [np.clip(end + draws.normal(size=8) * size, 0.5, 1.3) for size in (1e-4, 1e-3, 1e-2) * 30]
        assert max(map(posterior, tried)) < posterior(np.minimum(end, 1.3)) + 0.01


def test_a_drift_that_stays_the_same_is_none(healthy):
    made, model, _ = healthy
    constant = Drift(with_room(model.vector())).at(np.full(KNOTS, 0.1))
    one, other = filtered(with_terms(made), constant, SMALL), filtered(made, model.vector(), SMALL)
    assert one.log_likelihood == pytest.approx(other.log_likelihood, rel=1e-9)


def test_a_level_that_stays_the_same_is_another_friction(healthy):
    made, model, _ = healthy
    p = model.vector()
    raised = np.append(p[:EXTENDED], 0.1)
    p[COULOMB], p[STICTION] = 1.1 * p[COULOMB], 1.1 * p[STICTION]
    level = replace(made, terms=(Term(LEVEL, np.ones(len(made))),))
    one, other = filtered(level, raised, SMALL), filtered(made, p, SMALL)
    assert one.log_likelihood == pytest.approx(other.log_likelihood, rel=1e-5)
