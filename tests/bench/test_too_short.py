"""A run that shows too little says what there was too little of."""

from whole_run import run_on

SCENARIO = """schema: etb_hil/scenario/1
name: Short
phases:
  - {id: zero, kind: current_zero, duration: 0.5 s}
  - {id: move, kind: step, positions: [30 deg, 45 deg], hold: 50 ms, approach: 5 rad/s}
"""


def test_a_run_that_is_over_too_soon_is_not_blamed_on_gaps(tmp_path):
    path = tmp_path / "short.yaml"
    path.write_text(SCENARIO)
    unit = run_on(tmp_path, scenario=path).results.unit
    assert (unit.verdict, unit.reason_id) == ("inconclusive", "too_little_motion")
    assert "segments of at least 17 ms in all" in unit.reason
