"""A value against its limits: what decides, on both sides of each edge, and what a measurement keeps."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from whole_run import run_briskly_on, run_on

from etb_hil.base.outcome import UnitVerdict
from etb_hil.diagnosis import measurements
from etb_hil.diagnosis.limits_file import load_limits
from etb_hil.diagnosis.measurement_kind import Estimate, FailedEstimate
from etb_hil.diagnosis.measurement_registry import measurement_kinds, phases_needed
from etb_hil.diagnosis.measuring import Measured, failed_remarks, stand
from etb_hil.replays.session_replay import replay
from etb_hil.results.measurement import Measurement

PASS, FAIL, UNDECIDED = UnitVerdict.PASS, UnitVerdict.FAIL, UnitVerdict.INCONCLUSIVE


@pytest.mark.parametrize(
    ("low", "high", "limit_low", "limit_high", "band", "verdict"),
    [
        # numbers that are exact in binary: on an edge nothing is decided
        (0.25, 0.75, None, 1.0, 0.25, UNDECIDED),
        (0.25, 0.74, None, 1.0, 0.25, PASS),
        (1.25, 1.75, None, 1.0, 0.25, UNDECIDED),
        (1.26, 1.75, None, 1.0, 0.25, FAIL),
        (-2.0, -1.25, None, -1.0, 0.25, UNDECIDED),
        (-2.0, -1.26, None, -1.0, 0.25, PASS),
        (-0.74, -0.5, None, -1.0, 0.25, FAIL),
        (1.25, 1.5, 1.0, None, 0.25, UNDECIDED),
        (1.26, 1.5, 1.0, None, 0.25, PASS),
        (0.5, 0.75, 1.0, None, 0.25, UNDECIDED),
        (0.5, 0.74, 1.0, None, 0.25, FAIL),
        (-0.75, -0.5, -1.0, None, 0.25, UNDECIDED),
        (-0.74, -0.5, -1.0, None, 0.25, PASS),
        (-1.5, -1.26, -1.0, None, 0.25, FAIL),
        (0.0, 1.0, None, 1.0, 0.0, UNDECIDED),
        (1.0, 2.0, None, 1.0, 0.0, UNDECIDED),
        (1.5, 1.6, 1.0, 2.0, 0.0, PASS),
        (0.5, 1.5, 1.0, 2.0, 0.0, UNDECIDED),
        (1.5, 2.5, 1.0, 2.0, 0.0, UNDECIDED),
        (0.5, 0.6, 1.0, 2.0, 0.0, FAIL),
        (2.5, 2.6, 1.0, 2.0, 0.0, FAIL),
        (2.05, 2.06, 1.0, 2.0, 0.03125, UNDECIDED),
    ],
)
def test_an_interval_against_its_limits(low, high, limit_low, limit_high, band, verdict):
    assert stand(0.5 * (low + high), low, high, limit_low, limit_high, band) is verdict


@pytest.mark.parametrize(("value", "verdict"), [(0.0, PASS), (0.5, PASS), (-0.01, UNDECIDED), (0.51, UNDECIDED)])
def test_a_value_outside_its_own_interval_decides_nothing(value, verdict):
    assert stand(value, 0.0, 0.5, None, 1.0, 0.0) is verdict
    assert stand(value, 0.0, 0.5, 1.0, None, 0.0) is (FAIL if verdict is PASS else UNDECIDED)


@given(*[st.integers(-9, 9)] * 4, st.sampled_from([0.0, 0.125]))
def test_two_limits_are_each_held_by_itself(low, wide, limit_low, apart, band):
    low, high, limit_high = float(low), float(low + abs(wide)), float(limit_low + abs(apart))
    each = [
        stand(low, low, high, float(limit_low), None, band),
        stand(low, low, high, None, limit_high, band),
    ]
    worst = next(verdict for verdict in (FAIL, UNDECIDED, PASS) if verdict in each)
    assert stand(low, low, high, float(limit_low), limit_high, band) is worst


MADE = '''
"""Values of every sort."""

from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind


def compute(run):
    return [
        Estimate(0.5, 0.4, 0.6, suffix="_pass", note="as told"),
        Estimate(0.5, 0.4, 0.6, suffix="_unseen", name="of its own", may_pass=False),
        Estimate(2.5, 2.4, 2.6, suffix="_fail", may_pass=False),
        Estimate(1.0, 0.9, 1.1, suffix="_near"),
        Estimate(None, suffix="_none"),
        Estimate(0.5, None, 0.6, suffix="_no_low"),
        Estimate(0.5, 0.4, None, suffix="_no_high"),
        Estimate(2.5, 2.4, 2.6, suffix="_free"),
        Estimate(0.5, 0.5, 0.5, suffix="_least", is_least=True),
        Estimate(2.5, 2.5, 2.5, suffix="_least_late", is_least=True),
        Estimate(None, 0.0, 0.6, suffix="_bound"),
        Estimate(None, 0.0, 2.5, suffix="_bound_late"),
    ]


MEASUREMENT = MeasurementKind(
    id="made", name="made up", unit="A", compute=compute, order=1,
    suffixes="pass|unseen|fail|near|none|no_low|no_high|free|least|least_late|bound|bound_late",
)
'''
ALL = ("pass", "unseen", "fail", "near", "none", "no_low", "no_high", "least", "least_late", "bound", "bound_late")


@pytest.fixture
def made(tmp_path, monkeypatch):
    """Add a measurement to those that there are, as if its file stood beside theirs."""
    folder = tmp_path / "measurements"
    folder.mkdir()
    (folder / "made.py").write_text(MADE)
    monkeypatch.setattr(measurements, "__path__", [*measurements.__path__, str(folder)])
    for known in (measurement_kinds, phases_needed):
        known.cache_clear()
    yield
    for known in (measurement_kinds, phases_needed):
        known.cache_clear()


@pytest.mark.usefixtures("made")
@pytest.mark.parametrize(("side", "passes", "fails"), [("max", PASS, FAIL), ("min", FAIL, PASS)])
def test_what_a_value_lacks_decides_its_verdict(tmp_path, side, passes, fails):
    limits, scenario = tmp_path / "limits.yaml", tmp_path / "short.yaml"
    entries = "".join(f"  made_{name}: {{{side}: 1 A}}\n" for name in ALL)
    limits.write_text(
        f'schema: etb_hil/limits/2\npart_number: A\nrevision: "1"\nlimits:\n{entries}marginal_band: 3 %\n'
    )
    phase = "{id: zero, kind: current_zero, duration: 0.2 s}"
    scenario.write_text(f"schema: etb_hil/scenario/1\nname: short\nphases:\n  - {phase}\n")
    found = run_on(tmp_path, scenario=scenario, limits=limits).results.measurements
    unseen = UNDECIDED if passes is PASS else passes  # a fail needs no whole look
    failed = UNDECIDED if fails is PASS else fails
    late = FAIL if side == "max" else UNDECIDED  # the true value may be higher, and never lower
    expected = (passes, unseen, failed, UNDECIDED, None, UNDECIDED, UNDECIDED, UNDECIDED, late)
    expected += (passes, UNDECIDED, None)  # of a bound, too, a limit says whether it is kept
    assert [found[f"made_{name}"].verdict for name in (*ALL, "free")] == list(expected)
    assert (found["made_pass"].note, found["made_pass"].name) == ("as told", "made up (pass)")
    assert (found["made_unseen"].note, found["made_unseen"].name) == ("", "made up (of its own)")


@pytest.mark.parametrize(("low", "high"), [(None, None), (0.0, None), (None, 1.0), (0.0, 1.0)])
def test_a_value_is_limited_where_one_of_both_limits_is_stated(low, high):
    one = Measurement("a", "a", None, "A", limit_low=low, limit_high=high)
    limited = Measured(measurement_kinds()["holding_current"], Estimate(None), one).is_limited
    assert limited is (low is not None or high is not None)


def test_a_remark_names_the_measurements_whose_plug_in_failed():
    def value(name, estimate):
        one = Measurement(name, f"name of {name}", estimate.value, "A")
        return Measured(measurement_kinds()["holding_current"], estimate, one)

    found = [value("a", Estimate(1.0)), value("b", FailedEstimate(None)), value("c", FailedEstimate(None))]
    (remark,) = failed_remarks(found)
    assert (remark.id, remark.text) == ("measurement_failed", "no value of name of b, name of c")
    assert failed_remarks(found[:1]) == []


LIMITS = """\
schema: etb_hil/limits/2
part_number: A-1
revision: "1"
limits:
  T_st: {max: 20 mN·m, shaft: motor}
  T_c: {min: 0.5 N·m, max: 0.6 N·m}
  omega_s: {max: 100 rad/s}
marginal_band: 3 %
"""


@pytest.fixture(scope="module")
def live(tmp_path_factory):
    return run_briskly_on(tmp_path_factory.mktemp("sessions"))


def test_each_measurement_is_held_against_its_own_limit(live, tmp_path):
    path = tmp_path / "limits.yaml"
    path.write_text(LIMITS)
    limits = load_limits(path)
    again = replay(live.session.folder, limits=path)
    free, held = live.results.measurements, again.results.measurements
    assert [one.id for one in held.values()] == [one.id for one in free.values()]
    assert [free[name].verdict for name in ("T_st", "T_c")] == [PASS, PASS]
    assert [held[name].verdict for name in ("T_st", "T_c")] == [PASS, FAIL]
    assert (held["T_st"].limit_low, held["T_st"].limit_high) == (None, pytest.approx(0.36))
    assert (held["T_c"].limit_low, held["T_c"].limit_high) == (0.5, 0.6)
    judged = {name for name in limits.by_id if name in held}
    for name, one in held.items():
        assert one.name
        assert (one.low, one.high) == (free[name].low, free[name].high)
        if name not in judged:
            assert (one.verdict, one.limit_low, one.limit_high) == (None, None, None)
        elif one.low is not None:
            said = stand(one.value, one.low, one.high, one.limit_low, one.limit_high, 0.03)
            assert one.verdict is said or one.verdict is UNDECIDED
    assert any(one.note for one in held.values())
