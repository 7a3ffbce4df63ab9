"""Behind a coarse encoder a fit may end where a torque stands for the motion; it begins again then."""

import pytest
from explain_cases import hidden_case

from etb_hil.discrepancy.measured.filter_record import as_record
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.estimation.record import joined
from etb_hil.hypotheses.constants import PARTS, SEARCHED
from etb_hil.hypotheses.misfit import misfit
from etb_hil.hypotheses.prepared import prepared


@pytest.mark.parametrize("seed", range(979100, 979103))
def test_of_a_healthy_unit_nothing_is_left_to_be_explained(seed):
    """64 counts a turn, beside the plate's sensor."""
    hidden = hidden_case(seed, view="coarse_encoder")
    whole = joined([as_record(one, hidden.model) for one in measurements_of(hidden.recording, hidden.model)])
    record, fit = prepared(whole.thinned(SEARCHED, PARTS), hidden.model).calibrated()
    assert len(record) <= SEARCHED
    assert misfit(fit).is_nothing
