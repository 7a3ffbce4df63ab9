"""What a bench makes uncertain of a unit, beside the tolerances of its model file."""

from dataclasses import replace

import numpy as np
import pytest
from independent_throttle import Unit
from throttle_as_model import bench_model

from etb_hil.estimation.record import record
from etb_hil.hypotheses.prepared import prepared

TIME = np.arange(100) * 1e-3
MODEL = bench_model(Unit())


@pytest.mark.parametrize("counts", [64, 16384])
def test_where_the_stops_are_is_known_to_half_of_the_encoders_step(counts):
    model = replace(MODEL, sensors=MODEL.sensors.model_copy(update={"motor_counts_per_turn": counts}))
    made = prepared(record(TIME, 0.0 * TIME, model, motor=TIME, plate=TIME), model)
    half = np.pi / counts / model.values.gear_ratio
    reaches = {one.name: one.reach for one in made.unknowns}
    for name in ("stop_low", "stop_high", "limp_home"):
        assert reaches[name] == pytest.approx(model.tolerance(name) + half)


def test_without_an_encoder_it_is_the_plates_sensors_step():
    made = prepared(record(TIME, 0.0 * TIME, MODEL, plate=TIME), MODEL)
    half = 0.5 * MODEL.sensors.plate_range / 2**MODEL.sensors.plate_bits
    (found,) = (one.reach for one in made.unknowns if one.name == "stop_low")
    assert found == pytest.approx(MODEL.tolerance("stop_low") + half)
