"""What the data and the bench's model may differ by: each threshold on both of its sides, with known fits."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from etb_hil.base.stock import find
from etb_hil.diagnosis.assessment import Assessment
from etb_hil.diagnosis.contradiction import (
    Widening,
    against_each_other,
    gain_range,
    heated,
    law_remarks,
    remarks,
    resistance_at_rest,
    resistance_fits,
    widened,
    withholding,
)
from etb_hil.diagnosis.evidence import gather_evidence
from etb_hil.diagnosis.friction_laws import Law
from etb_hil.diagnosis.friction_model import AGEING, COULOMB, DROP, LOG_EXPONENT, LOG_SQUARE, VISCOUS
from etb_hil.diagnosis.hot_motor import HotMotor, hot_motor
from etb_hil.diagnosis.interval import Interval
from etb_hil.diagnosis.local_friction import LocalFriction
from etb_hil.diagnosis.prior import (
    CONSTANT,
    INERTIA,
    PARAMETERS,
    PRELOAD_CLOSE,
    PRELOAD_OPEN,
    SLOPE_CLOSE,
    SLOPE_OPEN,
    prior_of,
)
from etb_hil.diagnosis.segment_bootstrap import Spread
from etb_hil.diagnosis.stribeck_fit import StribeckFit
from etb_hil.diagnosis.ticks import Ticks
from etb_hil.diagnosis.voltage_balance import VoltageBalance
from etb_hil.diagnosis.windows import Windows
from etb_hil.plant.parameters import load_model

MODEL = load_model(find("model", "default"))
UNIT = MODEL.values  # 1.5 ohm to 10 %, 0.36 V·s/rad to 3 %, both preloads 0.35 N·m to 3 %
BALANCE = VoltageBalance(0.36, 0.0, 1.5, 0.0)
A_LITTLE = 1e-6
SIDES = pytest.mark.parametrize(("beyond", "is_said"), [(-A_LITTLE, False), (A_LITTLE, True)])
SIGNS = pytest.mark.parametrize("sign", [1.0, -1.0])


def fitted(off=None, errors=None, *, is_one_error=False):
    """Return the fit of the model's unit, but for what is `off`, with standard errors by parameter."""
    parameters, shift = np.zeros(PARAMETERS), np.zeros(PARAMETERS)
    parameters[COULOMB], parameters[DROP] = UNIT.coulomb, UNIT.stiction - UNIT.coulomb
    parameters[VISCOUS], parameters[LOG_EXPONENT] = UNIT.viscous, LOG_SQUARE
    for index, value in (off or {}).items():
        parameters[index] += value
    for index, value in (errors or {}).items():
        shift[index] = value
    variance = np.outer(shift, shift) if is_one_error else np.diag(shift * shift)
    none = np.empty(0)
    spread = Spread(np.zeros((999, PARAMETERS)), variance)
    return StribeckFit(parameters, spread, none, none, np.empty((0, PARAMETERS)), 1.0)


def ticks_of(current, voltage):
    n = len(current)
    zero, kind = np.zeros(n), np.ones(n, np.int64)
    return Ticks(np.arange(n) * 1e-3, zero, np.array(current), np.array(voltage), zero, zero, zero, zero + 1.0, kind)


def assessed(balance=BALANCE, opening=30, closing=30, *, has_fit=True):
    """Return what a run with so many windows says of the model's unit."""
    ticks = ticks_of(np.zeros(200), np.zeros(200))
    velocity = np.repeat([1.0, -1.0], [opening, closing])
    windows = Windows(np.full(len(velocity), 100))
    evidence = gather_evidence(ticks, windows, velocity, UNIT, np.zeros(len(velocity), np.int64))
    laws = [Law(fitted(), prior_of(MODEL, UNIT, 0.01, balance), 1.0)] if has_fit else []
    return Assessment(evidence, laws, balance, None, ())


def withheld(balance=BALANCE, local=None, hot=None, **windows):
    return [reason.id for reason in withholding(assessed(balance, **windows), local, MODEL, UNIT, hot)]


def pushed(*cells):
    """Return cells from (deg, even torque in N·m, standard error)."""
    angle, even, error = np.array(cells, float).reshape(-1, 3).T
    return LocalFriction(np.radians(angle), np.zeros(len(angle)), even, error)


@SIDES
@SIGNS
def test_a_resistance_may_be_off_by_its_tolerance_ten_kelvin_and_four_errors(sign, beyond, is_said):
    off = sign * (0.15 + 0.04 * 1.5 + 4.0 * 0.01 + beyond)
    assert resistance_fits(1.5 + off, 0.01, MODEL, UNIT) is not is_said
    assert withheld(replace(BALANCE, resistance=1.5 + off, resistance_error=0.01)) == (
        ["resistance_contradicts"] if is_said else []
    )


@SIDES
@SIGNS
def test_a_back_emf_may_be_off_by_its_tolerance_five_kelvin_and_four_errors(sign, beyond, is_said):
    off = sign * (0.03 * 0.36 + 0.01 * 0.36 + 4.0 * 0.001 + beyond)
    balance = replace(BALANCE, back_emf=0.36 + off, back_emf_error=0.001)
    assert withheld(balance) == (["back_emf_contradicts"] if is_said else [])


def test_a_motor_that_is_hot_or_has_no_voltage_contradicts_nothing():
    another = VoltageBalance(0.2, 0.0, 3.0, 0.0)
    assert withheld(another) == ["resistance_contradicts", "back_emf_contradicts"]
    assert withheld(another, hot=HotMotor(40.0, 30.0, 50.0, 0.156, -0.08)) == []
    assert withheld(None) == []


@SIDES
@SIGNS
def test_a_torque_in_both_directions_of_motion_is_a_spring_elsewhere(sign, beyond, is_said):
    found = withheld(local=pushed((20.0, 0.0, 0.0), (40.0, sign * (0.05 + 4.0 * 0.01 + beyond), 0.01)))
    assert found == (["spring_elsewhere"] if is_said else [])


def test_the_surest_place_of_a_spring_elsewhere_is_named():
    """The second cell stands out less than the first one, but its error is smaller, too."""
    local = pushed((20.0, 0.3, 0.07), (40.0, -0.2, 0.01), (60.0, 0.1, 0.001))
    (reason,) = withholding(assessed(), local, MODEL, UNIT, None)
    assert "at 40.0 deg the plate is pushed by -0.200 N·m" in reason.text
    assert withheld(local=pushed()) == []


def test_a_torque_at_its_threshold_is_no_spring_elsewhere():
    assert withheld(local=pushed((40.0, 0.05, 0.0))) == []


@pytest.mark.parametrize(
    ("opening", "closing", "is_said"), [(30, 30, False), (29, 30, True), (30, 29, True), (500, 0, True)]
)
def test_thirty_windows_each_way_tell_friction_from_springs(opening, closing, is_said):
    assert withheld(opening=opening, closing=closing) == (["one_way"] if is_said else [])
    assert withheld(opening=opening, closing=closing, has_fit=False) == []


def test_the_gravest_reason_comes_first():
    found = withheld(VoltageBalance(0.2, 0.0, 3.0, 0.0), pushed((40.0, 0.2, 0.01)), opening=0)
    assert found == ["resistance_contradicts", "back_emf_contradicts", "spring_elsewhere", "one_way"]


def test_only_a_motor_that_is_not_the_models_is_asked_for_heat():
    assert heated(None, MODEL, UNIT, 20.0) is None
    assert heated(VoltageBalance(0.999 * 0.36, 0.0, 1.01 * 1.5, 0.0), MODEL, UNIT, 20.0) is None
    assert heated(VoltageBalance(1.1 * 0.36, 0.0, 1.3 * 1.5, 0.0), MODEL, UNIT, 20.0) is None
    found = heated(VoltageBalance(0.92 * 0.36, 0.0, 1.156 * 1.5, 0.0), MODEL, UNIT, 20.0)
    assert found.kelvin == pytest.approx(40.0)


def test_heat_is_weighed_by_what_winding_and_magnets_may_be_off():
    """Where they do not agree, the one with the narrower tolerance says more of the temperature."""
    balance = VoltageBalance(0.93 * 0.36, 0.001, 1.2 * 1.5, 0.01)
    expected = hot_motor(balance, MODEL, UNIT, 20.0, (0.10 + 0.04, 0.03 + 0.01))
    found = heated(balance, MODEL, UNIT, 20.0)
    assert (found.kelvin, found.resistance) == pytest.approx((expected.kelvin, 0.2))


def test_a_resistance_at_rest_is_that_of_all_ticks_with_a_voltage():
    current, noise = np.array([2.0, 3.0, -4.0, 2.5]), np.array([0.3, -0.2, 0.1, 0.0])
    voltage = 1.5 * current + noise
    expected = np.linalg.lstsq(current[:, None], voltage, rcond=None)[0][0]
    assert resistance_at_rest(ticks_of(current, voltage)) == pytest.approx(expected)
    unknown = ticks_of([*current, 50.0], [*voltage, math.nan])
    assert resistance_at_rest(unknown) == pytest.approx(expected)


@pytest.mark.parametrize(("current", "is_enough"), [(2.0, True), (-2.0, True), (1.999, False), (0.0, False)])
def test_two_amperes_are_enough_to_measure_a_resistance_at_rest(current, is_enough):
    found = resistance_at_rest(ticks_of([current] * 50, [1.5 * current] * 50))
    assert found == (pytest.approx(1.5) if is_enough else None)


def test_without_a_voltage_there_is_no_resistance_at_rest():
    assert resistance_at_rest(ticks_of([5.0, 5.0], [math.nan, math.nan])) is None
    assert resistance_at_rest(ticks_of([], [])) is None


LISTED = pytest.mark.parametrize(
    ("index", "unit_of", "name", "tolerance"),
    [
        (PRELOAD_OPEN, 1.0, "preload_open", MODEL.tolerance("preload_open")),
        (PRELOAD_CLOSE, 1.0, "preload_close", MODEL.tolerance("preload_close")),
        (SLOPE_OPEN, 1.0, "slope_open", MODEL.tolerance("slope_open")),
        (SLOPE_CLOSE, 1.0, "slope_close", MODEL.tolerance("slope_close")),
        (INERTIA, UNIT.inertia, "inertia", MODEL.tolerance("inertia")),
        (VISCOUS, 1.0, "viscous", MODEL.tolerance("viscous")),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)


@LISTED
@SIDES
@SIGNS
def test_a_parameter_beyond_tolerance_and_four_errors_is_said(index, unit_of, name, tolerance, sign, beyond, is_said):
    """The fit has a share of the inertia, and the viscosity itself; of all others how far they are off."""
    error = 0.1 * tolerance
    off = sign * (tolerance + 4.0 * error) * (1.0 + beyond)
    found = remarks(fitted({index: off / unit_of}, {index: error / unit_of}), BALANCE, MODEL, UNIT)
    assert [reason.id for reason in found] == (["model_contradicted"] if is_said else [])
    if is_said:
        nominal = getattr(UNIT, name)
        assert f"beyond the model's tolerance: {name} is {nominal + off:.3g} " in found[0].text
        assert f"(model {nominal:.3g})" in found[0].text


def test_a_parameter_at_the_end_of_its_tolerance_is_not_beyond_it():
    at_end = fitted({PRELOAD_OPEN: MODEL.tolerance("preload_open")})
    assert remarks(at_end, BALANCE, MODEL, UNIT) == []
    assert gain_range(at_end, BALANCE, MODEL, UNIT) == (1.0, 1.0)


def springs(opening, closing=None, constant=0.0, errors=None, *, is_one_error=False):
    """Return the fit of both springs and the motor's constant by what shares they are off."""
    closing = opening if closing is None else closing
    off = {PRELOAD_OPEN: 0.35 * opening, PRELOAD_CLOSE: 0.35 * closing, CONSTANT: constant}
    return fitted(off, errors, is_one_error=is_one_error)


def says_springs(fit, balance=None):
    found = remarks(fit, balance, MODEL, UNIT)
    return bool(found) and "both springs are" in found[0].text


ERRORS = {PRELOAD_OPEN: 0.35 * 0.01, PRELOAD_CLOSE: 0.35 * 0.01, CONSTANT: 0.01}


@SIDES
@SIGNS
@pytest.mark.parametrize(
    ("errors", "is_one_error", "reach"),
    [(None, False, 0.0), (ERRORS, False, 4.0 * 0.01 * math.sqrt(2.0)), (ERRORS, True, 0.0)],
    ids=["sure", "apart", "one error"],
)
def test_both_springs_off_against_the_motor_are_said_without_a_voltage(
    sign, beyond, is_said, errors, is_one_error, reach
):
    """Spring and motor may be off by 3 % each; their errors count as that of their difference."""
    share = sign * (0.06 + reach + beyond)
    split = springs(0.4 * share, constant=-0.6 * share, errors=errors, is_one_error=is_one_error)
    assert says_springs(split) is is_said
    assert not says_springs(split, BALANCE)


def test_the_spring_that_is_off_by_less_says_by_how_much():
    for both, said in (((0.2, 0.1), "+10.0%"), ((-0.1, -0.2), "-10.0%")):
        assert f"both springs are {said} off" in remarks(springs(*both), None, MODEL, UNIT)[0].text


@pytest.mark.parametrize("both", [(0.2, 0.0), (0.0, 0.2), (0.2, -0.2), (-0.2, 0.2), (0.2, 0.05), (0.05, 0.2)])
def test_one_spring_alone_or_both_against_each_other_are_not_the_motors(both):
    assert not says_springs(springs(*both))


def test_the_models_own_law_is_not_remarked():
    assert law_remarks(fitted()) == []


def test_another_exponent_and_ageing_contacts_are_said_by_how_much():
    (exponent,) = law_remarks(fitted({LOG_EXPONENT: math.log(0.5)}))
    assert "omega_s)^1), where the model has the exponent 2." in exponent.text
    assert "at rest" not in exponent.text
    (ages,) = law_remarks(fitted({AGEING: 0.25 * UNIT.stiction}))
    assert "by 25.0% of T_st" in ages.text
    assert "exponent" not in ages.text
    (both,) = law_remarks(fitted({LOG_EXPONENT: math.log(0.5), AGEING: 0.01}))
    assert both.id == "another_friction_law"
    assert all(word in both.text for word in ("exponent 2; it grows", "at rest"))


NO_BOUND = replace(BALANCE, resistance=0.0)  # nothing of the gain: a current that is not that of the motor


@pytest.mark.parametrize(
    ("off", "low", "high"),
    [
        ((0.0, 0.0), 1.0, 1.0),
        ((0.02, 0.02), 1.0, 1.0),  # inside of their tolerances
        ((0.2, 0.2), 1.0, 1.23),
        ((-0.2, -0.2), 0.77, 1.0),
        ((0.2, 0.1), 1.0, 1.13),
        ((0.1, 0.2), 1.0, 1.13),
        ((-0.2, -0.1), 0.87, 1.0),
        ((-0.1, -0.2), 0.87, 1.0),
        ((0.2, 0.0), 1.0, 1.0),
        ((-0.2, 0.0), 1.0, 1.0),
        ((0.2, -0.2), 1.0, 1.0),
        ((-1.5, -1.5), 0.05, 1.0),  # no gain below a twentieth
    ],
)
def test_springs_that_are_both_off_may_be_the_currents_gain(off, low, high):
    """As much as the weaker one of them, and as their tolerance may hide."""
    assert gain_range(springs(*off), NO_BOUND, MODEL, UNIT) == pytest.approx((low, high))
    assert gain_range(springs(*off), replace(BALANCE, resistance=-1.0), MODEL, UNIT) == pytest.approx((low, high))


@pytest.mark.parametrize(
    ("off", "resistance", "low", "high"),
    [
        (0.2, 1.5, 1.0, 1.14),  # 10 % of tolerance, and 4 % of warmth
        (0.2, 1.5 / 1.05, 1.0, 1.05 * 1.14),
        (0.2, 1.5 / 1.25, 1.0, 1.23),
        (0.2, 1.5 / 0.8, 1.0, 1.0),
        (-0.2, 1.5, 0.86, 1.0),
        (-0.2, 1.5 / 0.95, 0.95 * 0.86, 1.0),
        (-0.2, 1.5 / 0.8, 0.77, 1.0),
        (-0.2, 1.5 / 1.25, 1.0, 1.0),
        (-0.2, 0.75, 1.0, 1.0),
        (0.0, 1.5 / 1.25, 1.0, 1.0),
    ],
)
def test_the_resistance_bounds_the_currents_gain(off, resistance, low, high):
    balance = replace(BALANCE, resistance=resistance)
    assert gain_range(springs(off), balance, MODEL, UNIT) == pytest.approx((low, high))


@SIDES
def test_a_spring_is_off_where_its_error_does_not_explain_it(beyond, is_said):
    error = 0.35 * 0.01
    fit = springs((0.03 + 0.04) * (1.0 + beyond), errors={PRELOAD_OPEN: error, PRELOAD_CLOSE: error})
    assert gain_range(fit, NO_BOUND, MODEL, UNIT)[1] == pytest.approx(1.10 if is_said else 1.0)


VAGUE = replace(BALANCE, back_emf_error=0.01 * 0.36)  # brushes that take a part of the voltage away


@pytest.mark.parametrize(
    ("balance", "said"),
    [(None, "a voltage would tell"), (VAGUE, "the voltage does not tell the motor's constant")],
    ids=["no voltage", "a vague one"],
)
def test_where_no_voltage_tells_the_constant_all_of_it_may_be_the_motors_or_the_springs(balance, said):
    """The springs alone are inside of their tolerances; the fit took most of it for the motor's constant."""
    for sign, expected in ((1.0, (0.9 * 0.97, 1.05)), (-1.0, (0.95, 1.1 * 1.03))):
        fit = springs(sign * 0.02, constant=-sign * 0.1)
        assert gain_range(fit, balance, MODEL, UNIT) == pytest.approx(expected)
        assert f"or both springs ({said})" in remarks(fit, balance, MODEL, UNIT)[0].text


def test_a_voltage_that_does_not_tell_the_constant_bounds_no_gain_by_its_resistance():
    another = replace(VAGUE, resistance=1.5 / 0.8)
    assert gain_range(springs(0.2), another, MODEL, UNIT) == pytest.approx((0.97, 1.23))


def test_springs_may_have_pulled_the_constant_off_what_the_voltage_tells():
    for sign, expected in ((1.0, (0.98, 1.0)), (-1.0, (1.0, 1.02))):
        fit = springs(sign * 0.02, constant=-sign * 0.02)
        assert gain_range(fit, NO_BOUND, MODEL, UNIT) == pytest.approx(expected)
    another = replace(NO_BOUND, back_emf=0.98 * UNIT.back_emf)
    assert gain_range(springs(0.0, constant=-0.02), another, MODEL, UNIT) == pytest.approx((1.0, 1.0))


@SIDES
def test_a_voltage_tells_the_constant_where_four_errors_are_within_its_tolerance(beyond, is_said):
    balance = replace(BALANCE, back_emf_error=0.0075 * 0.36 * (1.0 + beyond))
    assert says_springs(springs(0.02, constant=-0.1), balance) is is_said


def directions(opening, closing):
    """Return the fit of friction that is so much higher in opening, in N·m by the springs that stand in for it."""
    return fitted({PRELOAD_OPEN: opening, PRELOAD_CLOSE: -closing}, {PRELOAD_OPEN: 0.001, PRELOAD_CLOSE: 0.001})


OWN = 0.03 * 0.35


@pytest.mark.parametrize(
    ("opening", "closing", "friction"),
    [
        (0.05, 0.08, 0.05 + OWN),
        (0.08, 0.05, 0.05 + OWN),
        (-0.08, -0.05, -0.05 - OWN),
        (-0.05, -0.08, -0.05 - OWN),
        (0.05, 0.002, 0.002 + OWN),  # one of them beyond its tolerance is enough
        (0.002, 0.05, 0.002 + OWN),
        (-0.002, -0.05, -0.002 - OWN),
        (0.05, -0.05, 0.0),
        (-0.05, 0.05, 0.0),
        (0.05, 0.0, 0.0),
        (0.0, 0.05, 0.0),
        (0.01, 0.01, 0.0),  # both inside
    ],
)
def test_springs_off_against_each_other_may_be_friction_by_direction(opening, closing, friction):
    assert against_each_other(directions(opening, closing), MODEL) == pytest.approx(friction)


@SIDES
@pytest.mark.parametrize("which", [0, 1])
def test_friction_by_direction_begins_beyond_tolerance_and_four_errors(which, beyond, is_said):
    both = [0.002, 0.002]
    both[which] = OWN + 4.0 * 0.001 + beyond
    assert (against_each_other(directions(*both), MODEL) != 0.0) is is_said


@pytest.mark.parametrize(
    ("interval", "gain", "low", "high"),
    [
        ((1.0, 1.0, 1.0), (1.0, 1.0), 0.981, 1.019),  # 95 % of an even 2 %
        ((-1.0, -1.0, -1.0), (1.0, 1.0), -1.019, -0.981),
        ((0.0, -1.96, 3.92), (1.0, 1.0), -1.96, 3.92),  # a normal error alone
        ((1.0, 1.0, 1.0), (0.5, 2.0), 0.981 / 2.0, 1.019 / 0.5),
        ((-1.0, -1.0, -1.0), (0.5, 2.0), -1.019 / 0.5, -0.981 / 2.0),
        ((0.0, -1.96, 3.92), (0.5, 2.0), -1.96 / 0.5, 3.92 / 0.5),
    ],
)
def test_a_torque_is_as_unsure_as_the_currents_gain(interval, gain, low, high):
    assert widened(*interval, gain) == pytest.approx((low, high))


@given(
    value=st.floats(-1.0, 1.0),
    below=st.floats(0.0, 0.5),
    above=st.floats(0.0, 0.5),
    least=st.floats(0.5, 1.0),
    most=st.floats(1.0, 2.0),
)
def test_a_widened_interval_holds_the_one_before_at_every_gain(value, below, above, least, most):
    low, high = widened(value, value - below, value + above, (least, most))
    for gain in (least, 1.0, most):
        for end in (value - below, value + above, 0.981 * value, 1.019 * value):
            assert low - 1e-4 <= end / gain <= high + 1e-4  # as 1.96 is rounded


@pytest.mark.parametrize(
    ("interval", "way", "low", "high"),
    [
        ((0.2, 0.18, 0.22), (0.0, 0.0), 0.18, 0.22),
        ((0.2, 0.18, 0.22), (0.1, 0.5), 0.9 * 0.18, 1.5 * 0.22),
        ((0.2, -0.1, 0.22), (0.1, 0.5), -0.1, 1.5 * 0.22),
        ((0.2, 0.18, 0.22), (1.5, 0.0), -0.5 * 0.18, 0.22),
    ],
)
def test_an_uneven_way_widens_break_away_friction(interval, way, low, high):
    found = Widening(way=way).of_stiction(Interval(*interval))
    assert (found.value, found.low, found.high) == pytest.approx((interval[0], low, high))


STICTION = Interval(0.25, 0.2, 0.3)


@pytest.mark.parametrize(
    ("interval", "widening", "expected"),
    [
        ((0.2, 0.18, 0.22), Widening(), (0.2, 0.18, 0.22)),
        ((0.2, 0.18, 0.22), Widening(way=(0.1, 0.5)), (0.2, 0.4 * 0.18, 1.5 * 0.22)),
        ((0.2, 0.18, 0.22), Widening(way=(0.7, 0.5)), (0.2, 0.0, 1.5 * 0.22)),
        ((0.2, -0.1, 0.22), Widening(), (0.2, 0.0, 0.22)),
        ((0.2, 0.18, 0.22), Widening(is_confounded=True), (0.22, 0.0, 0.22)),
        ((0.2, 0.0, 0.22, True), Widening(way=(0.1, 0.5)), (1.5 * 0.22, 0.0, 1.5 * 0.22)),
        ((0.2, 0.18, 0.22), Widening(is_bent=True), (0.2, 0.18, 0.3)),
        ((0.2, 0.18, 0.35), Widening(way=(0.0, 0.5), is_bent=True), (0.2, 0.5 * 0.18, 1.5 * 0.35)),
        ((-0.1, -0.2, -0.05), Widening(), (0.0, 0.0, 0.0)),
        ((-0.1, -0.2, 0.05), Widening(way=(0.0, 1.0)), (0.0, 0.0, 0.1)),
        ((0.2, 0.18, 0.1), Widening(), (0.2, 0.18, 0.2)),
    ],
)
def test_sliding_friction_may_be_that_of_the_lowest_place(interval, widening, expected):
    found = widening.of_coulomb(Interval(*interval), STICTION)
    assert (found.value, found.low, found.high) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("low", "widening", "settled", "lowest", "highest"),
    [
        (0.1, Widening(), 0.5, 0.1, 0.3),
        (0.1, Widening(way=(0.1, 0.5)), 0.0, 0.9 * 0.1, 1.5 * 0.3),
        (0.1, Widening(way=(0.1, 0.5)), 0.4, 0.7 * 0.1, 1.5 * 0.3),
        (0.1, Widening(way=(0.7, 0.5)), 1.0, 0.0, 1.5 * 0.3),
        (-0.1, Widening(way=(0.1, 0.5)), 1.0, -0.1, 1.5 * 0.3),
        (0.1, Widening(gain=(0.5, 2.0)), 0.0, 0.1, 0.3),
    ],
)
def test_the_friction_curve_is_as_unsure_as_way_and_gain(low, widening, settled, lowest, highest):
    """What has fallen from break-away friction lies lower by its share of what the way adds to that."""
    found = widening.of_curve(Interval(0.2, low, 0.3), settled)
    assert found.value == 0.2
    assert (found.low, found.high) == pytest.approx(widened(0.2, lowest, highest, widening.gain))


def test_without_a_reason_an_interval_is_widened_by_the_usual_gain_alone():
    found = Widening().of_curve(Interval(1.0, 1.0, 1.0), 0.0)
    assert (found.low, found.high) == pytest.approx((0.981, 1.019))


def test_an_uneven_way_moves_the_margin_by_its_share_of_break_away_friction():
    found = Widening(way=(0.1, 0.5)).of_margin(Interval(0.1, 0.08, 0.12), 0.2)
    assert (found.value, found.low, found.high) == pytest.approx((0.1, 0.08 - 0.5 * 0.2, 0.12 + 0.1 * 0.2))
