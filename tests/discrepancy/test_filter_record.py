"""Where no current flows, a record says so, whatever the sensor's zero is."""

from dataclasses import replace

import numpy as np
import pytest
from explain_cases import hidden_case

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.measured.filter_record import as_record
from etb_hil.discrepancy.measured.segments import measurements_of

OFFSETS = [0.0, 0.02, -0.06]  # A: up to twelve times the noise


@pytest.fixture(scope="module", params=[3, 4])
def case(request):
    hidden = hidden_case(request.param, seconds=20.0)
    return Balances(measurements_of(hidden.recording, hidden.model)[0], hidden.model).measured, hidden.model


@pytest.mark.parametrize("offset", OFFSETS)
def test_an_open_bridge_is_seen_beside_an_offset_of_the_current(case, offset):
    measured, model = case
    off = np.isinf(as_record(replace(measured, current=measured.current + offset), model).unsure)
    known = np.isinf(as_record(measured, model).unsure)
    assert 0.01 < known.mean() < 0.5
    assert off[known].mean() > 0.9


@pytest.mark.parametrize("offset", OFFSETS)
def test_a_driven_motor_is_no_open_bridge(case, offset):
    """What the plate is held by has a current, and no more than a zero is off by is none."""
    measured, model = case
    off = np.isinf(as_record(replace(measured, current=measured.current + offset), model).unsure)
    current = as_record(measured, model).readings[:, 0]
    assert not np.any(off & (np.abs(current) > 0.2))
