"""From which size on an effect shows beside base parameters that stay inside their tolerances."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from answers import plain, write_explanation
from synthetic import MODEL, measurement, textbook

from etb_hil.discrepancy.answer.detection_limits import detection_limits, where_it_went
from etb_hil.discrepancy.candidates.candidate import beyond_judging
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.measured.filter_record import as_record
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.hypotheses.candidates import candidates
from etb_hil.hypotheses.misfit import misfit
from etb_hil.hypotheses.prepared import prepared
from etb_hil.plant.device import Device, Driven
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.layout import EXTENDED

NOT_OF_A_THROTTLE = {
    "fan_drag": "stops hold it before it is fast",
    "gravity_load": "nothing that gravity turns",
}
LINEAR = Device(is_throttle=False, driven=Driven.FORCE, is_linear=True)


@pytest.fixture(scope="module")
def healthy():
    return search(MODEL, [Balances(measurement(MODEL.vector(), seed=5), MODEL)])


@pytest.mark.parametrize(
    "id_",
    [
        "spring_preload_shift",
        *(
            pytest.param(id_, marks=pytest.mark.study)
            for id_ in ("measurement_delay", "current_sensor_gain", "cogging_torque", "friction_temperature")
        ),
    ],
)
def test_a_calibration_leaves_of_an_effect_what_its_limit_promises(healthy, id_):
    """Without twice as much the model has the misfit of a cause, without half as much it has not."""
    effect = CATALOGUE[id_]
    made = prepared(as_record(healthy.balances[0].measured, MODEL), MODEL)
    shapes = candidates(made.record, made.parameters, [effect])
    p, strength = shapes[len(shapes) // 2].parameters[:EXTENDED], effect.indices[effect.searched[0]]
    limit = detection_limits(healthy)[id_].limit
    for times, stands_out in ((0.5, False), (2.0, True)):
        with_it = MODEL.vector()
        with_it[list(effect.stated_indices)] = p[list(effect.stated_indices)]
        with_it[strength] = times * limit
        assert misfit(calibrated(with_it)).is_nothing != stands_out


def calibrated(p):
    return prepared(as_record(measurement(p, seed=5), MODEL), MODEL).calibrated()[1]


@pytest.mark.parametrize(
    ("missing", "effect", "says"),
    [
        ({"has_temperature": False}, "friction_temperature", "no temperature, or a constant one"),
        ({"current": None}, "current_sensor_gain", "no current"),
        ({"plate": None}, "sensor_hysteresis", "no plate angle"),
    ],
)
def test_without_a_sensor_effects_say_what_is_missing(healthy, missing, effect, says):
    measured = healthy.balances[0].measured
    assert beyond_judging([Balances(measured, MODEL)]) == NOT_OF_A_THROTTLE
    assert beyond_judging([Balances(replace(measured, **missing), MODEL)])[effect] == says


def test_a_coarse_encoder_is_a_second_angle_beside_the_plates_sensor(healthy):
    measured = healthy.balances[0].measured
    plates = replace(measured, angle=measured.plate, plate=None, is_plates=True)
    assert beyond_judging([Balances(replace(plates, encoder=measured.angle), MODEL)]) == NOT_OF_A_THROTTLE
    alone = beyond_judging([Balances(plates, MODEL)])
    assert alone["motor_angle_delay"] == alone["sensor_hysteresis"] == "no motor angle"
    assert not {"angle_delay", "plate_angle_delay"} & set(alone)


def test_of_a_place_nothing_is_promised_where_the_record_did_not_go(tmp_path):
    findings = search(MODEL, [Balances(measurement(MODEL.vector(), 5, textbook(6.0)), MODEL)])
    limits = plain(detection_limits(findings))
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
    assert "not detectable in these data" in limits["end_stop_compliance"]["text"]  # the sweep meets no stop
    assert (limits["end_stop_compliance"]["limit"], limits["end_stop_compliance"]["within_bounds"]) == (None, False)
    measured = findings.balances[0].measured
    linear = SimpleNamespace(measured=replace(measured, device=LINEAR))
    as_linear = SimpleNamespace(balances=[linear], is_linear=True)
    assert where_it_went(as_linear) == "0.199 to 1.28 m"
