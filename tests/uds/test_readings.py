"""Roles that are read by data identifier: in the bench file, on the bus, in a run, in its replay."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from uds_bench import faulty_run
from whole_run import files

from etb_hil.base.errors import InputError
from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.base.stock import find
from etb_hil.bench.bench_file import load_bench
from etb_hil.bench.job import execute, prepare
from etb_hil.canio.data_identifiers import DataIdentifier, RequestedValues
from etb_hil.canio.frames import classic_frames, concatenate_frames
from etb_hil.canio.requested_values import RequestedValuesDecoder
from etb_hil.controller.uds.faults import UdsFault, UdsFaultKind
from etb_hil.recording.recording import ClockGrade
from etb_hil.recording.samples import SampleBlock
from etb_hil.replays.session_replay import replay
from etb_hil.report.html_report import render_page
from etb_hil.session.interpolated_readings import InterpolatedReadings

MS = 1_000_000
CURRENT = DataIdentifier("motor_current", 0xD001, 2, True, 1e-3, 0.0, 10 * MS)
HOUSING = DataIdentifier("temperature", 0xD002, 1, False, 1.0, -40.0, 1000 * MS)
TRACK = DataIdentifier("throttle_angle", 0xF201, 2, True, 1e-4, 0.0, 10 * MS, rate=3)
REQUESTED = RequestedValues(0x7E0, 0x7E8, 0x6E8, False, (CURRENT, HOUSING, TRACK))
SHORT = """
schema: etb_hil/scenario/1
name: Short
phases:
  - {id: current_zero, kind: current_zero, duration: 0.6 s}
  - {id: ramp, kind: ramp, between: [10 deg, 20 deg], speed: 0.2 rad/s}
  - {id: return, kind: off, duration: 0.6 s}
"""
PLOTS = dict.fromkeys(("friction_over_speed", "friction_over_angle", "time_traces"), "<svg/>")


def bench_text(**data):
    """Return the stock bench as plain data, with other entries of `uds.data`."""
    plain = yaml.safe_load(find("bench", "virtual_uds_data").read_text("utf-8"))
    for role, entry in data.items():
        plain["uds"]["data"][role] = plain["uds"]["data"].get(role, {}) | entry
    return plain


@pytest.fixture
def load(tmp_path):
    def _load(plain):
        path = tmp_path / "bench.yaml"
        path.write_text(yaml.safe_dump(plain), "utf-8")
        return load_bench(path)

    return _load


@pytest.fixture
def short(tmp_path):
    path = tmp_path / "short.yaml"
    path.write_text(SHORT, "utf-8")
    return path


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sessions")
    return {
        unit: execute(prepare(files(bench="virtual_uds_data", unit=unit)), folder, "", 3)
        for unit in ("default", "faulty")
    }


@given(
    length=st.sampled_from([1, 2, 4]),
    signed=st.booleans(),
    scale=st.floats(1e-6, 1e3),
    offset=st.floats(-1e3, 1e3),
    share=st.floats(0.0, 1.0),
)
def test_a_value_survives_its_bytes(length, signed, scale, offset, share):
    one = DataIdentifier("temperature", 0xD000, length, signed, scale, offset, MS)
    low = -(1 << 8 * length - 1) if signed else 0
    raw = low + share * ((1 << 8 * length) - 1)
    assert one.value(one.data(raw * scale + offset)) == pytest.approx(raw * scale + offset, abs=scale)


def test_scale_and_unit_become_si(load):
    setup = load(bench_text(motor_current={"scale": 2.5, "offset": 10}, temperature={"unit": "K", "offset": 200}))
    requested = setup.dialect.requested
    assert requested.of("motor_current").value((400).to_bytes(2, "big")) == pytest.approx(1.010)
    assert requested.of("temperature").value(b"\x64") == pytest.approx(26.85)
    assert setup.dialect.source_of("motor_current") == "DID 0xd001"


@pytest.mark.parametrize(
    ("data", "told"),
    [
        ({"motor_current": {"unit": "mV"}}, "allowed: A, mA"),
        ({"motor_current": {"every": "5 ms"}}, "from 10 ms on"),
        ({"motor_current": {"scale": 0}}, "a scale of 0"),
        ({"motor_current": {"read": "fast"}}, "0xF200 to 0xF2FF"),
        ({"motor_current": {"read": "fast", "id": 0xF201}}, "give 'periodic'"),
        ({"temperature": {"id": 0xD001}}, "same data identifier"),
        ({"throttle_angle": {"id": 0xD009, "unit": "deg"}}, "has a signal as well"),
        ({"motor_voltage": {"id": 0xD009, "unit": "V"}}, "no role that is read"),
    ],
)
def test_what_cannot_be_read_is_refused_with_its_place(load, data, told):
    with pytest.raises(InputError, match=r"bench\.yaml") as caught:
        load(bench_text(**data))
    assert told in str(caught.value)


def exchange():
    """Return the frames of readings, among others: two of the current, one in two frames with the housing's."""
    return concatenate_frames(
        [
            classic_frames(10 * MS, 0x7E0, [bytes.fromhex("0322d001")]),
            classic_frames(11 * MS, 0x121, [bytes(8)]),
            classic_frames(12 * MS, 0x7E8, [bytes.fromhex("0562d00103e8")]),
            classic_frames(15 * MS, 0x6E8, [bytes.fromhex("010064")]),
            classic_frames(20 * MS, 0x7E0, [bytes.fromhex("0522d001d002")]),
            classic_frames(21 * MS, 0x7E8, [bytes.fromhex("037f2278")]),
            classic_frames(24 * MS, 0x7E8, [bytes.fromhex("100862d001fc18d0")]),
            classic_frames(25 * MS, 0x7E0, [bytes.fromhex("300000")]),
            classic_frames(26 * MS, 0x7E8, [bytes.fromhex("210241")]),
            classic_frames(30 * MS, 0x7E0, [bytes.fromhex("0322d001")]),
            classic_frames(31 * MS, 0x7E8, [bytes.fromhex("0462d00103")]),  # a byte is missing
            classic_frames(32 * MS, 0x7E8, [bytes.fromhex("0562d00103e8")]),  # nobody asked
        ]
    )


@given(st.lists(st.integers(0, 12), max_size=4))
def test_the_decoder_finds_readings_however_frames_are_cut(cuts):
    decoder, found = RequestedValuesDecoder(REQUESTED), {}
    frames = exchange()
    edges = [0, *sorted(cuts), len(frames)]
    for first, last in pairwise(edges):
        for block in decoder.push(frames.select(slice(first, last))):
            (role,) = block.columns
            times, values = found.setdefault(role, ([], []))
            times += block.time_ns.tolist()
            values += block.columns[role].tolist()
    assert found["motor_current"] == ([11 * MS, 22 * MS], [1.0, -1.0])
    assert found["temperature"] == ([22 * MS], [25.0])
    assert found["throttle_angle"] == ([15 * MS], [pytest.approx(0.01)])
    assert decoder.half_ns["motor_current"] == [1 * MS, 2 * MS]


@given(st.lists(st.binary(max_size=8), max_size=30), st.data())
def test_no_frames_break_the_decoder(payloads, data):
    decoder = RequestedValuesDecoder(REQUESTED)
    for k, payload in enumerate(payloads):
        decoder.push(classic_frames(k * MS, data.draw(st.sampled_from([0x7E0, 0x7E8, 0x6E8])), [payload]))
    decoder.push(classic_frames(100 * MS, 0x6E8, [bytes.fromhex("010064")]))
    assert decoder.times_ns["throttle_angle"][-1] == 100 * MS


def block(source, role, time_ns, values):
    time_ns = np.asarray(time_ns, np.int64)
    return SampleBlock(source, time_ns, time_ns, {role: np.asarray(values, float)}, np.zeros(len(time_ns), np.int64))


@pytest.mark.parametrize("cyclic", [["EtbEncoder"], []])
@given(cuts=st.lists(st.integers(0, 400), max_size=5))
def test_rows_lie_on_the_lines_between_readings(cyclic, cuts):
    read_at = np.array([*range(5, 205, 10), *range(300, 390, 10)]) * MS + 300_000
    values = np.sin(read_at * 1e-7)
    at = np.arange(400) * MS
    rows, got = InterpolatedReadings(cyclic, [CURRENT]), []
    edges = [-1, *sorted(c * MS for c in cuts), 400 * MS]
    for first, last in pairwise(edges):
        inside, read = (at > first) & (at <= last), (read_at > first) & (read_at <= last)
        part = rows.push(
            [
                block("EtbEncoder", "motor_angle", at[inside], at[inside] * 1e-9),
                block(CURRENT.source, "motor_current", read_at[read], values[read]),
            ]
        )
        if part is not None:
            got.append(part)
    time_ns = np.concatenate([part.time_ns for part in got])
    current = np.concatenate([part.columns["motor_current"] for part in got])
    lost = np.concatenate([part.lost_before for part in got])
    assert np.allclose(current, np.interp(time_ns, read_at, values))
    assert not ((time_ns > read_at[19]) & (time_ns < read_at[20])).any()  # nobody knows what was between
    assert time_ns[0] >= read_at[0]
    assert time_ns[-1] <= read_at[-1]
    after = int(np.flatnonzero(time_ns > 250 * MS)[0])
    assert lost[after] == 105  # the milliseconds from 195.3 to 300.3
    assert lost[1:].sum() == lost[after]


def test_a_unit_without_a_cyclic_current_is_judged(runs):
    results = runs["default"].results
    assert (results.bench.outcome, results.unit.verdict) == (BenchOutcome.OK, UnitVerdict.PASS)
    assert results.bench.safe_state
    assert results.timestamp_grade == ClockGrade.RECEIVE_STAMPS
    by_role = {one.role: one for one in results.bench.readings}
    assert list(by_role) == ["motor_current", "temperature", "supply_voltage"]
    current = by_role["motor_current"]
    assert current.rate_hz == pytest.approx(100, rel=0.05)
    assert 0.0 < current.time_error_worst_ms < 1.0
    assert by_role["temperature"].rate_hz == pytest.approx(1.0, rel=0.05)
    assert results.measurements["temperature"].value == pytest.approx(20.0, abs=1.0)


def test_what_it_costs_is_measured_and_said(runs):
    finished = runs["default"]
    cyclic = 2 * 0.0034  # N·m, the width of the same unit's interval with a cyclic current
    stiction = finished.results.measurements["T_st"]
    assert stiction.low < 0.171 < stiction.high
    assert stiction.high - stiction.low > 1.5 * cyclic
    reason = next(one for one in finished.found.reasons if one.id == "read_by_request")
    assert "98 times a second" in reason.text
    assert "break-away friction" in reason.text
    page = render_page(finished.results, PLOTS, {})
    assert "Motor current (DID 0xd001)" in page
    assert "times as wide" in stiction.note
    assert stiction.note in page
    current = next(one for one in finished.results.bench.readings if one.role == "motor_current")
    assert f"{current.rate_hz:.3g} a second" in page


def test_a_faulty_unit_fails_by_what_was_read(runs):
    results = runs["faulty"].results
    assert (results.unit.verdict, results.unit.reason_id) == (UnitVerdict.FAIL, "T_st_beyond_limit")
    assert [code.code for code in results.unit_diagnostics.codes_after] == ["P2119"]


def test_it_replays_to_the_same_numbers(runs):
    for finished in runs.values():
        again = replay(finished.session.folder).results
        assert again.unit == finished.results.unit
        assert dict(again.measurements) == dict(finished.results.measurements)
        assert again.bench.readings == finished.results.bench.readings


def test_readings_too_far_apart_leave_it_undecided(tmp_path):
    path = tmp_path / "bench.yaml"
    path.write_text(yaml.safe_dump(bench_text(motor_current={"every": "80 ms"})), "utf-8")
    chosen = replace(files(unit="default"), bench=path)
    results = execute(prepare(chosen), tmp_path / "sessions", "", 3).results
    assert results.bench.outcome is BenchOutcome.OK, results.bench
    assert results.unit.verdict is UnitVerdict.INCONCLUSIVE
    assert results.bench.safe_state


def test_values_that_the_unit_sends_by_itself(tmp_path, short):
    plain = bench_text(
        motor_current={"id": 0xF201, "read": "fast"}, temperature={"id": 0xF202, "read": "slow", "every": "200 ms"}
    )
    plain["uds"] |= {"periodic": 0x6E8, "routines": {"learn_stops": {"id": 0x0203, "before": True, "after": True}}}
    path = tmp_path / "bench.yaml"
    path.write_text(yaml.safe_dump(plain), "utf-8")
    finished = execute(prepare(replace(files(scenario=short), bench=path)), tmp_path / "sessions", "", 3)
    results = finished.results
    assert results.bench.outcome is BenchOutcome.OK, results.bench
    assert [(one.when, one.outcome) for one in results.unit_diagnostics.routines] == [
        ("before", "done"),
        ("after", "done"),
    ]
    by_role = {one.role: one for one in results.bench.readings}
    current, temperature = by_role["motor_current"], by_role["temperature"]
    assert (current.is_polled, current.time_error_worst_ms) == (False, None)
    assert current.rate_hz == pytest.approx(100, rel=0.05)
    assert temperature.rate_hz == pytest.approx(5, rel=0.1)
    assert replay(finished.session.folder).results.bench.readings == results.bench.readings


@pytest.mark.parametrize(
    ("fault", "reasons"),
    [
        (UdsFaultKind.NO_ANSWER, {"frames_stopped", "uds_no_answer"}),
        (UdsFaultKind.PENDING_FOR_EVER, {"frames_stopped", "uds_no_answer"}),
        (UdsFaultKind.WRONG_LENGTH, {"uds_bad_answer"}),
        (UdsFaultKind.WRONG_SERVICE, {"uds_bad_answer"}),
        (UdsFaultKind.SECOND_TESTER, {"uds_second_tester"}),
    ],
)
def test_a_fault_amid_the_motion_ends_the_run_at_once(tmp_path, short, monkeypatch, fault, reasons):
    after_s = 1.5  # amid the ramp
    faults = (UdsFault(fault, 0x22, after_ns=round(after_s * 1e9)),)
    results = faulty_run(monkeypatch, files(scenario=short, bench="virtual_uds_data"), tmp_path, faults).results
    assert results.bench.outcome is BenchOutcome.FAULT
    assert results.bench.reason_id in reasons, results.bench
    assert results.unit.verdict is None
    assert results.duration_s < after_s + 1.5
