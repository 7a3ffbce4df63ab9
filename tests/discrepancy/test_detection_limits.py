"""From which size on an effect shows beside base parameters that stay inside their tolerances."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from answers import plain, write_explanation
from scipy.optimize import brentq, lsq_linear
from synthetic import MODEL, measurement, textbook

from etb_hil.discrepancy.answer.detection_limits import LEAST_GAIN, detection_limits, where_it_went
from etb_hil.discrepancy.answer.masking import MaskedEffect
from etb_hil.discrepancy.candidates.candidate import beyond_judging
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import calibrate
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.layout import EXTENDED


def masked(columns, column, low, high, least, groups=1, least_in=0.0):
    """Return what may hide a column; samples in as many groups of one length, of which one has to show `least_in`."""
    parts = np.split(columns, groups), np.split(column, groups)
    normals = np.stack([part.T @ part for part in parts[0]])
    crosses = np.stack([part.T @ own for part, own in zip(*parts, strict=True)])
    own = np.array([part @ part for part in parts[1]])
    return MaskedEffect(normals, low, high, crosses, own, least**2, np.full(groups, max(least_in, 1e-9) ** 2))


@pytest.mark.parametrize("seed", range(5))
def test_the_size_is_that_of_an_independent_solver(seed):
    """A column that is nearly what the base does: what their boxes let them take is what the size hangs on."""
    rng = np.random.default_rng(seed)
    columns = rng.standard_normal((200, 6))
    column = columns @ rng.standard_normal(6) + 0.01 * rng.standard_normal(200)
    low, high = -rng.uniform(0.1, 1.0, 6), rng.uniform(0.1, 1.0, 6)

    def over(size):
        return np.sqrt(2.0 * lsq_linear(columns, size * column, (low, high), method="bvls").cost) - 5.0

    expected = brentq(over, 0.0, 100.0)
    assert masked(columns, column, low, high, 5.0).smallest(100.0, 1.0) == pytest.approx(expected, rel=0.03)
    assert masked(columns, -column, low, high, 5.0).smallest(100.0, -1.0) == pytest.approx(expected, rel=0.03)
    assert masked(columns, column, low, high, 5.0).smallest(0.9 * expected, 1.0) is None


def test_what_base_parameters_are_shows_only_once_they_are_at_their_ends():
    columns = 100.0 * np.eye(4)[:, :1]
    one = masked(columns, columns[:, 0], np.array([-0.5]), np.array([2.0]), 10.0)
    assert one.smallest(10.0, 1.0) == pytest.approx(2.1, rel=0.03)
    assert one.smallest(10.0, -1.0) == pytest.approx(0.6, rel=0.03)
    assert one.smallest(2.0, 1.0) is None


def test_what_is_spread_over_all_groups_has_to_show_in_one():
    column, nothing = np.ones(8), np.zeros((8, 1))
    box = np.array([-1.0]), np.array([1.0])
    assert masked(nothing, column, *box, 4.0, groups=4).smallest(9.0, 1.0) == pytest.approx(2.0**0.5, rel=0.03)
    there = masked(nothing, column, *box, 4.0, groups=4, least_in=4.0)
    assert there.smallest(9.0, 1.0) == pytest.approx(4.0 / 2.0**0.5, rel=0.03)


@pytest.fixture(scope="module")
def healthy():
    return search(MODEL, [Balances(measurement(MODEL.vector(), seed=5), MODEL)])


@pytest.mark.parametrize("id_", ["spring_preload_shift", "current_sensor_gain", "supply_sag", "current_sensor_offset"])
def test_a_calibration_leaves_of_an_effect_what_its_limit_promises(healthy, id_):
    """Of twice as much it leaves more than is asked of a cause, and of half as much less."""
    limit = detection_limits(healthy, LEAST_GAIN)[id_].limit
    plain = healthy.final.fit.cost
    for times, stands_out in ((0.5, False), (2.0, True)):
        p = MODEL.vector()
        p[CATALOGUE[id_].indices[0]] = times * limit
        b = Balances(measurement(p, seed=5), MODEL)
        b.weights = healthy.balances[0].weights
        left = calibrate(MODEL, [b], np.concatenate([MODEL.vector(), healthy.final.fit.whole[EXTENDED:]])).fit.cost
        assert (left > (1.0 + LEAST_GAIN) * plain) == stands_out


@pytest.mark.parametrize(
    ("missing", "effect", "says"),
    [
        ({"has_temperature": False}, "friction_temperature", "no temperature, or a constant one"),
        ({"current": None}, "current_sensor_gain", "no current"),
        ({"plate": None}, "sensor_hysteresis", "no second angle"),
    ],
)
def test_without_a_sensor_effects_say_what_is_missing(healthy, missing, effect, says):
    measured = healthy.balances[0].measured
    assert beyond_judging([Balances(measured, MODEL)]) == {}
    assert beyond_judging([Balances(replace(measured, **missing), MODEL)])[effect] == says


def test_of_a_place_nothing_is_promised_where_the_record_did_not_go(tmp_path):
    findings = search(MODEL, [Balances(measurement(MODEL.vector(), 5, textbook(6.0)), MODEL)])
    limits = plain(detection_limits(findings, LEAST_GAIN))
    went = "11.4 to 73.2 deg"
    of_place = {id_ for id_, effect in CATALOGUE.items() if effect.is_of_place}
    assert {"friction_position_local", "friction_position_periodic", "limp_home_dead_zone"} < of_place
    seen = {id_ for id_ in of_place if limits[id_]["limit"] is not None}
    assert {"friction_position_periodic", "spring_nonlinear"} <= seen
    assert {id_ for id_, one in limits.items() if one["valid_range"]} == seen
    for id_ in seen:
        assert limits[id_]["valid_range"] == went
        assert limits[id_]["text"].endswith(f"valid for the recorded range: {went}")
    found = {"verdict": "adequate", "causes": [], "confounded": [], "data_quality": [], "detection_limits": limits}
    page = write_explanation(found, None, tmp_path).read_text("utf-8")
    assert f"These hold only in the range of this motion, {went}: " in page
    measured = findings.balances[0].measured
    as_linear = SimpleNamespace(balances=[SimpleNamespace(measured=replace(measured, is_linear=True))])
    assert where_it_went(as_linear) == "0.199 to 1.28 m"
