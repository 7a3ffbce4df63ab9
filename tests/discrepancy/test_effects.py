"""What every effect of the catalogue must pass, whatever it is."""

import numpy as np
import pytest
from synthetic import MODEL, measurement, swept

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import residual_of
from etb_hil.discrepancy.fitting.fit import fit_of, gauss_newton
from etb_hil.discrepancy.fitting.unknowns import effect_unknowns, finer_unknowns, start
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.plant.effects import backlash_contact, ports, readings
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.contract import misfits, misstatements
from etb_hil.plant.effects.curves import bell, halved, pointed, side
from etb_hil.plant.effects.effect import Balance, Parity
from etb_hil.plant.effects.entries import entry_of, problem_of, whole_vector
from etb_hil.plant.effects.layout import EXTENDED, PLATE_INERTIA

EFFECTS = [pytest.param(effect, id=id_) for id_, effect in CATALOGUE.items()]
# A search with an angle that is read elsewhere takes three times as long.
ONE_OF_EACH_BALANCE = {one.balance: id_ for id_, one in CATALOGUE.items() if one.balance is not Balance.ANGLE}.values()
SEARCHED = [
    pytest.param(effect, id=id_, marks=[] if id_ in ONE_OF_EACH_BALANCE else pytest.mark.study)
    for id_, effect in CATALOGUE.items()
]


def _with(effect, share=1.0):
    """The extended vector with an effect at some steps of its first strengths."""
    p = MODEL.vector()
    for parameter, place in zip(effect.parameters, effect.indices, strict=True):
        if not parameter.is_strength:
            p[place] = parameter.starts[len(parameter.starts) // 2]
    for k in effect.searched:
        parameter = effect.parameters[k]
        size = 4.0 * share * parameter.starts[0]
        p[effect.indices[k]] = np.clip(size, 0.9 * parameter.low, 0.9 * parameter.high)
    return p


def _refined(effect, p):
    """An extended vector with an effect's finer shapes half-way to their upper bounds, its shapes as first tried."""
    for parameter, place in zip(effect.parameters, effect.indices, strict=True):
        if not parameter.is_strength:
            p[place] = parameter.starts[0]
    for parameter, place in _finer(effect):
        p[place] = 0.5 * parameter.high
    return p


@pytest.fixture(scope="module")
def balances():
    return Balances(measurement(MODEL.vector(), seed=1), MODEL)


def test_effects_stand_apart_in_the_vector():
    places = [place for effect in CATALOGUE.values() for place in effect.stated_indices]
    assert len(set(places)) == len(places)
    assert min(places) > PLATE_INERTIA
    assert max(places) < EXTENDED
    assert list(CATALOGUE) == sorted(CATALOGUE)


@pytest.mark.parametrize("effect", EFFECTS)
def test_it_keeps_its_contract(effect):
    assert misstatements(effect, {id_: one for id_, one in CATALOGUE.items() if id_ != effect.id}) == []
    assert misfits(effect) == []


@pytest.mark.parametrize("effect", EFFECTS)
def test_zero_strength_changes_nothing(effect, balances):
    plain = MODEL.vector()
    shaped = _refined(effect, _with(effect, 0.0))
    shaped[list(effect.acting_indices)] = 0.0
    nuisance = np.zeros(4)
    np.testing.assert_array_equal(balances.residual(shaped, nuisance), balances.residual(plain, nuisance))


@pytest.mark.parametrize("effect", EFFECTS)
def test_injected_strength_is_recovered(effect):
    true = _with(effect)
    b = Balances(measurement(true, seed=3), MODEL)
    residual = residual_of([b])
    begin = start(MODEL)
    unknowns = effect_unknowns(effect, [true[place] for place in effect.indices])
    for place in effect.indices:
        begin[place] = true[place]
    for k in effect.strengths:
        begin[effect.indices[k]] = 0.3 * true[effect.indices[k]]
    free = [unknowns[k] for k in effect.searched]
    fit, _ = gauss_newton(residual, fit_of(residual, begin), free, 8, tolerance=1e-4)
    for k in effect.searched:
        place = effect.indices[k]
        assert fit.whole[place] == pytest.approx(true[place], rel=0.12), effect.parameters[k].name


def _finer(effect):
    """Return the finer shapes that balances fit, with their places: further waves are as the likelihood has them."""
    stated = zip(effect.finer, effect.stated_indices[len(effect.parameters) :], strict=True)
    return [(one, place) for one, place in stated if not one.under]


@pytest.mark.parametrize("effect", [p for p in EFFECTS if p.values[0].finer])
def test_injected_finer_shapes_are_recovered(effect):
    true = _refined(effect, _with(effect))
    b = Balances(measurement(true, seed=3, degrees=(-40.0, 70.0)), MODEL)
    residual = residual_of([b])
    begin = start(MODEL)
    for place in effect.indices:
        begin[place] = true[place]
    for parameter, place in _finer(effect):
        begin[place] = (*parameter.elsewhere, 0.0)[0]  # from 0 no slope may lead
    fit, _ = gauss_newton(residual, fit_of(residual, begin), finer_unknowns(effect), 8, tolerance=1e-4)
    for parameter, place in _finer(effect):
        assert fit.whole[place] == pytest.approx(true[place], abs=0.2 * (parameter.high - parameter.low)), (
            parameter.name
        )
    assert fit.cost < fit_of(residual, begin).cost


@pytest.mark.parametrize("effect", EFFECTS)
def test_its_term_stands_in_the_balance_that_it_declares(effect, balances):
    nuisance = np.zeros(4)
    before = balances.channels(MODEL.vector(), nuisance)
    after = balances.channels(_with(effect), nuisance)
    change = [float(np.linalg.norm(a - b)) for a, b in zip(after, before, strict=True)]
    declared = list(Balance).index(effect.balance)
    assert change[declared] > 1.0
    if effect.balance is Balance.VOLTAGE:
        assert change[0] == 0.0
        assert change[2] == 0.0


@pytest.mark.parametrize("effect", [p for p in EFFECTS if p.values[0].parity is not Parity.NEITHER])
def test_its_term_has_the_parity_that_it_declares(effect):
    """Friction, drag and angles' errors change their sign with the direction or do not; voltages with the current."""
    p, plain = _with(effect), MODEL.vector()
    if effect.balance is Balance.VOLTAGE:
        # Even under time run backwards: the current keeps its sign, and so does the loss.
        forward = ports.voltage_loss(1.3, 6.0, False, ports.slow_start(45.0, p), p)
        assert forward != 0.0
        assert ports.voltage_loss(-1.3, -6.0, False, ports.slow_start(45.0, p), p) == pytest.approx(-forward)
        return
    if effect.balance is Balance.ANGLE:
        change = [_apart(p, omega) for omega in (2.0, -2.0)]
    elif effect is CATALOGUE["current_sensor_offset"]:
        currents = np.array([1.3, -1.3])
        change = list(readings.measured_current(currents, np.full(2, 25.0), p) - currents)
    else:
        change = [_passive(p, omega) - _passive(plain, omega) for omega in (2.0, -2.0)]
    even, odd = abs(change[0] + change[1]), abs(change[0] - change[1])
    assert max(even, odd) > 0.0
    assert (even > odd) == (effect.parity is Parity.EVEN)


def _apart(p, omega):
    """By how much plate sensor and encoder differ where the plate slides past a place well above limp-home."""
    way = np.linspace(0.5, 0.8, 301)[:: int(np.sign(omega))]
    theta, gear = way[150], MODEL.values.gear_ratio
    plate = backlash_contact.on_plate(theta, theta, omega, 0.0, p) - theta if ports.is_loose(p) else 0.0
    read = readings.measured_angle(way * gear, p) / gear
    return plate + (readings.measured_plate(way, p) - way)[150] - (read - way)[150]


def _passive(p, omega):
    """Torque of steady sliding at some warm place near the upper stop, where every term says something."""
    total, slow = 0.0, ports.slow_start(45.0, p)
    ports.pass_time(slow, 0.0, 0.0, 0.0, 0.0, 45.0, 2.0, p)  # a rest of 2 s, and then a way
    ports.pass_time(slow, 0.0, float(np.sign(omega)), 0.0, 0.0, 45.0, 0.0, p)
    for theta in (0.35, 0.79, 1.475):
        elastic = ports.elastic_torque(theta, 0.0, p)
        if theta == 0.35:  # a dead zone is seen from its edge
            elastic += ports.elastic_torque(p[10] + 0.004, 0.0, p)
        level = ports.friction_level(theta, omega, elastic, 45.0, 0.0, slow, p)
        total += (
            np.sign(omega) * level
            + ports.viscosity(omega, 45.0, p) * omega
            + elastic
            + ports.motor_drag(theta, omega, slow, p)
        )
    return total


@pytest.mark.parametrize("effect", SEARCHED)
def test_it_is_found_when_hidden_alone(effect):
    share = 0.5 if effect.balance is Balance.ANGLE else 1.0  # four steps of play are more than gears have
    findings = search(MODEL, [Balances(measurement(_with(effect, share), seed=3), MODEL)])
    assert findings.verdict in ("explained", "ambiguous")
    # Where base parameters do the same, they may be two of them: T_c and T_st for what holds a plate at reversals.
    assert findings.accepted
    assert all(effect.id in (found.winner.id, *found.ambiguity_group) for found in findings.accepted)
    assert len(findings.accepted) == 1 or not any(found.winner.candidate.effect for found in findings.accepted)


@pytest.mark.parametrize("effect", EFFECTS)
def test_it_survives_a_model_file(effect):
    p = _refined(effect, _with(effect))
    entry = entry_of(effect, p)
    assert problem_of(effect.id, entry) is None
    again = whole_vector(MODEL.values.vector(), p[PLATE_INERTIA], [(effect.id, entry)])
    np.testing.assert_allclose(again, p, rtol=1e-5)


def said(id_, strengths):
    """Return the key that is wrong, and the message."""
    key, problem = problem_of(id_, strengths)
    return ".".join(key), str(problem)


def test_wrong_entries_are_refused_with_what_is_allowed():
    key, message = said("brushdrop", {})
    assert (key, message.startswith("unknown effect")) == ("id", True)
    assert message.endswith("did you mean 'brush_drop'?")
    key, message = said("brush_drop", {"drops": "1 V"})
    assert (key, "has no such parameter" in message) == ("strengths.drops", True)
    assert message.endswith("did you mean 'drop'?")
    for value, expected in (("1 A", "its unit is V"), ("30 V", "out of its range")):
        key, message = said("brush_drop", {"drop": value})
        assert (key, expected in message) == ("strengths.drop", True)


def test_the_sweep_excites_what_the_suite_needs():
    assert len(MODEL.vector()) == EXTENDED
    angle = swept()
    assert angle.min() < MODEL.values.stop_low
    assert angle.max() > MODEL.values.stop_high


def test_shared_curves_have_the_forms_that_they_say():
    x = np.array([-2.5, -1.0, -0.3, 0.0, 0.2, 0.7, 1.4])
    curve = np.vectorize(bell)
    np.testing.assert_allclose(curve(x, 2.0, 0.0), np.exp(-(x**2)))
    np.testing.assert_allclose(curve(x, 2.0, 1.0), 1.0 / (1.0 + x**2))
    np.testing.assert_allclose(curve(x, 1.0, -1.0), np.maximum(1.0 - np.abs(x), 0.0))
    np.testing.assert_allclose(curve(x, 2.0, 1.1e-4), np.exp(-(x**2)), atol=1e-3)
    for steepness in (1.0, 2.0, 5.0):
        for tail in (-1.0, 0.0, 0.4, 1.0):
            assert halved(0.0, steepness, tail) == 1.0
            assert halved(-1.0, steepness, tail) == pytest.approx(0.5)
    np.testing.assert_allclose(np.vectorize(side)(x, 0.0), np.tanh(x))
    np.testing.assert_allclose(np.vectorize(side)(x, 1.0), x / (1.0 + np.abs(x)))
    np.testing.assert_allclose(np.vectorize(side)(x, -1.0), np.clip(x, -1.0, 1.0))
    wave = np.vectorize(pointed)
    np.testing.assert_allclose(wave(np.sin(x), 1.0), 2.0 / np.pi * np.arcsin(np.sin(x)))
    np.testing.assert_allclose(wave(np.sin(x), 1e-5), wave(np.sin(x), -1e-5), atol=1e-5)
    assert np.all(wave(np.sin(x[x > 0.0]), -4.0) > np.sin(x[x > 0.0]))
    for lag in (-1.0, -0.5, 0.5, 1.0):
        settled = np.vectorize(side)(np.linspace(-6.0, 6.0, 121), lag)
        assert np.all(np.diff(settled) >= 0.0)
        assert np.all(np.abs(settled) <= 1.0)


def test_a_shaft_that_gives_way_gives_way_the_more_the_larger_the_load():
    """Up to what a stop's impact puts on it: a twist without end, or one that turns round, is no shaft's."""
    effect = CATALOGUE["shaft_compliance"]
    p = MODEL.vector()
    for share in (effect.parameters[1].low, -0.2, 0.0, 2.0, effect.parameters[1].high):
        p[list(effect.indices)] = [0.004, share]
        twist = np.array([ports.lead(load, p) for load in np.linspace(-8.0, 8.0, 81)])
        assert np.all(np.diff(twist) > 0.0)
        np.testing.assert_allclose(twist, -twist[::-1], atol=1e-12)


def _level(degrees, p):
    return ports.friction_level(0.79, 2.0, 0.3, degrees, 0.02, ports.slow_start(degrees, p), p)


@pytest.mark.parametrize(
    "id_", ["friction_position_periodic", "friction_position_local", "friction_asymmetry", "friction_load"]
)
def test_heat_is_a_factor_of_all_friction_whatever_presses_the_contact(id_):
    def warmed(p):
        cold, warm = (_level(degrees, p) for degrees in (25.0, 45.0))
        return warm / cold, ports.viscosity(2.0, 45.0, p) / ports.viscosity(2.0, 25.0, p)

    alone = _with(CATALOGUE["friction_temperature"])
    both = _with(CATALOGUE[id_])
    places = list(CATALOGUE["friction_temperature"].stated_indices)
    assert _level(25.0, both) != pytest.approx(_level(25.0, alone), rel=0.01)
    both[places] = alone[places]
    assert warmed(both) == pytest.approx(warmed(alone), rel=1e-12)
