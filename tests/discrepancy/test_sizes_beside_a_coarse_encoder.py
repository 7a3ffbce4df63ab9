"""Sizes that no balance shows: the motion is the plate's there, and a second angle is read by a coarse encoder."""

import pytest
from answers import plain
from explain_cases import hidden_case

from etb_hil.discrepancy.explain import explain


@pytest.mark.study
def test_play_of_the_plates_sensor_has_a_size():
    hidden = [hidden_case(seed, ("sensor_hysteresis",), view="coarse_encoder") for seed in range(214320, 214323)]
    found = [plain(explain([one.recording], one.model))["causes"] for one in hidden]
    assert {cause["id"] for causes in found for cause in causes} == {"sensor_hysteresis"}
    for size in (cause["parameters"]["half_width"] for causes in found for cause in causes):
        low, high = size["interval"]
        assert size["flags"] == []
        assert low < size["value"] < high
        assert high - low < 0.2 * size["value"]
