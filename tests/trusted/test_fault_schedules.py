"""Faults in combination, host and disk among them; `benchmarks/faults_schedules.py` runs as many as wanted."""

import pytest
from faults_schedules import BAD, BENCHES, judge
from faults_study import EXPECTED, job_of

pytestmark = [pytest.mark.spoilt, pytest.mark.slow]


@pytest.fixture(scope="module")
def jobs():
    return {(bench, unit): job_of(bench, unit) for bench in BENCHES for unit in EXPECTED}


@pytest.mark.parametrize("number", [0, 1, 2, *(pytest.param(k, marks=pytest.mark.study) for k in range(3, 8))])
def test_no_schedule_of_faults_makes_a_false_statement(jobs, number):
    kind, said = judge(number, jobs)
    assert kind not in BAD, said
