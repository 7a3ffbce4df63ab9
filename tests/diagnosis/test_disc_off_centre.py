"""A disc of the encoder off centre adds a wave to the angle, once a turn of the motor; friction stays as it is."""

from dataclasses import replace

import numpy as np
import pytest
from independent_throttle import Unit, friction_check, sense
from throttle_as_model import bench_model, rows_of

from etb_hil.base.stock import find
from etb_hil.diagnosis.diagnosis import Diagnosis
from etb_hil.diagnosis.limits_file import load_limits

LIMITS = load_limits(find("limits", "default"))
UNIT = Unit()
RUN, PHASES = friction_check(UNIT, creeps=())


def measured(eccentricity, phase=0.0, rate=1000):
    wave = eccentricity * np.sin(UNIT.gear_ratio * RUN.angle + phase) / UNIT.gear_ratio
    read = replace(RUN, angle=RUN.angle + wave, plate=RUN.angle if RUN.plate is None else RUN.plate)
    diagnosis = Diagnosis(bench_model(UNIT), LIMITS)
    for rows, kind in rows_of(sense(UNIT, read, rate, np.random.default_rng(4)), PHASES, rate):
        diagnosis.push(rows, kind)
    return diagnosis.finish()


def half_width(number):
    return 0.5 * (number.high - number.low)


@pytest.mark.parametrize("rate", [1000, 20000])
@pytest.mark.parametrize("phase", [0.0, 1.6, 3.1])
def test_friction_is_measured_nearly_as_well_as_with_a_centred_disc(phase, rate):
    """It cannot be quite as well: the speed has a wave of 2 % too, at which friction is taken."""
    centred, found = measured(0.0, rate=rate), measured(0.02, phase, rate)
    for name, true in (("T_st", UNIT.stiction), ("T_c", UNIT.coulomb), ("viscous", UNIT.viscous)):
        number = found.measurements[name]
        assert number.low < true < number.high
        assert half_width(number) < 1.5 * half_width(centred.measurements[name])
    assert found.verdict == centred.verdict


def test_a_disc_far_off_centre_gives_no_wrong_interval():
    """Four times what data sheets allow."""
    found = measured(0.08)
    assert found.measurements["T_c"].low < UNIT.coulomb < found.measurements["T_c"].high
