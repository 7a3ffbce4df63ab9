"""The scenarios that come with the bench run on the benches that come with it."""

import pytest
from faults_study import job_of

from etb_hil.base.stock import stock_names

RUN_WHOLE = {"friction_check", "break_away", "warm_check", "multisine", "reversals_at_limp_home"}  # test_stock_variants


@pytest.mark.parametrize("scenario", sorted({*stock_names("scenario")} - RUN_WHOLE))
def test_every_stock_scenario_passes_the_checks_before_a_run(scenario):
    job = job_of("virtual_classic", None, scenario)
    assert job.scenario.content.steps
