"""The main job end to end on the virtual bus: scenario to verdict, through real frames."""

import can
import pytest
from whole_run import run_on

from etb_hil.base.stock import find
from etb_hil.plant.parameters import load_model
from etb_hil.replays.session_replay import replay
from etb_hil.session.differences import first_difference


def truth(name):
    return load_model(find("model", name)).values


def number(finished, number_id):
    return next(n for n in finished.results.measurements.values() if n.id == number_id)


@pytest.mark.parametrize("bench", ["virtual_classic", "virtual_fd"])
@pytest.mark.parametrize(("unit", "verdict", "code"), [("default", "pass", 0), ("faulty", "fail", 10)])
def test_the_friction_check_tells_good_from_bad(tmp_path, bench, unit, verdict, code):
    finished = run_on(tmp_path, bench=bench, unit=unit)
    results = finished.results
    assert results.bench.outcome == "ok"
    assert results.bench.safe_state is True
    assert results.unit.verdict == verdict
    assert results.exit_code == code
    assert results.unit.reason
    values = truth(unit)
    assert number(finished, "T_st").value == pytest.approx(values.stiction, rel=0.03)
    assert number(finished, "T_c").value == pytest.approx(values.coulomb, rel=0.05)
    assert number(finished, "fastest").value > 2.15 * values.stribeck_velocity
    assert bool(results.exceedances) == (unit == "faulty")
    for episode in results.exceedances:
        assert episode.peak > episode.limit
        assert 0.0 <= episode.angle <= 1.5
        assert episode.temperature == pytest.approx(20.0, abs=2.0)


def test_a_replay_gives_the_same_results_to_the_bit(tmp_path):
    live = run_on(tmp_path, unit="faulty")
    again = replay(live.session.folder)
    assert first_difference(again) is None
    for name, column in live.found.series.items():
        assert column.tobytes() == again.found.series[name].tobytes(), name


def test_the_raw_log_is_read_by_python_can_with_sent_frames_marked(tmp_path):
    finished = run_on(tmp_path)
    with can.BLFReader(finished.session.raw_log) as reader:
        messages = list(reader)
    sent = [m for m in messages if not m.is_rx]
    counted = {m.name: m.frames for m in finished.results.bus.messages}
    assert len(messages) >= sum(counted.values())
    assert len(sent) >= counted["EtbCommand"]
    stamps = [m.timestamp for m in messages]
    assert stamps == sorted(stamps)


@pytest.mark.parametrize(("unit", "verdicts"), [("default", {"inconclusive"}), ("faulty", {"fail", "inconclusive"})])
@pytest.mark.parametrize("scenario", ["paper_sinusoid", "paper_step"])
def test_the_papers_references_run_and_pass_no_unit(tmp_path, scenario, unit, verdicts):
    finished = run_on(tmp_path, scenario=scenario, unit=unit)
    assert finished.results.bench.outcome == "ok"
    assert finished.results.unit.verdict in verdicts
    if unit == "default":
        assert finished.results.unit.reason_id == "places_not_seen"
        assert finished.results.exit_code == 4


def test_the_same_seed_gives_the_same_frames(tmp_path):
    first, second = (run_on(tmp_path, seed=5).session.raw_log.read_bytes() for _ in range(2))
    assert len(first) > 100_000
    # containers are cut where the host flushed: what they hold is compared, not the file
    assert _frames(tmp_path, first) == _frames(tmp_path, second)


def _frames(tmp_path, raw):
    path = tmp_path / "one.blf"
    path.write_bytes(raw)
    with can.BLFReader(path) as reader:
        return [(m.timestamp, m.arbitration_id, bytes(m.data)) for m in reader]
