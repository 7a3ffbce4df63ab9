"""The scenarios that come with the bench run on the benches that come with it."""

import pytest
from faults_study import job_of

from etb_hil.base.stock import stock_names


@pytest.mark.parametrize("scenario", stock_names("scenario"))
def test_every_stock_scenario_passes_the_checks_before_a_run(scenario):
    job = job_of("virtual_classic", None, scenario)
    assert job.scenario.content.steps
