"""Random units of the study whose numbers were wrong once."""

import numpy as np
import pytest
from random_units import job_of_study, one_unit


@pytest.mark.parametrize(("seed", "number"), [(2026112, 248), (4711, 2)])
def test_viscosity_is_not_taken_for_coulomb_friction(seed, number):
    """Their viscosity outweighs the drop from T_st to T_c: descents began with T_c above T_st, and stayed there."""
    row = one_unit(job_of_study("virtual_classic"), number, np.random.default_rng([seed, number]))
    assert row["T_c_found"] == pytest.approx(row["T_c"], rel=0.03)
    assert row["T_st_found"] == pytest.approx(row["T_st"], rel=0.03)
    assert row["verdict"] == row["expected"] == "pass"
