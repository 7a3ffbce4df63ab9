"""Tests of a throttle on a bench: `pytest` runs them, on the virtual bench until you name another one."""

import pytest

pytestmark = pytest.mark.etb_limits("limits.yaml")


@pytest.mark.etb_scenario("friction_check", serial="CI-1")
def test_the_unit_is_good(etb_run):
    assert etb_run.verdict == "pass", etb_run.reason
    assert etb_run.value("T_st") == pytest.approx(0.171, rel=0.1)  # N·m


@pytest.mark.etb_scenario("friction_check", unit="faulty")
def test_a_unit_that_sticks_is_found(etb_run):
    assert etb_run.verdict == "fail"
    assert "Break-away friction" in etb_run.reason


def test_noise_changes_nothing(etb_bench):
    values = [etb_bench.run("friction_check", seed=seed).value("T_st") for seed in (1, 2)]
    assert values[0] == pytest.approx(values[1], rel=0.02)
