"""The controller's own trouble codes are set by what its plate does; the table's measurements exist."""

import math

import pytest
from controller_harness import OFF, command, drive, model, stream

from etb_hil.base.modes import Mode
from etb_hil.controller.machine import Machine
from etb_hil.controller.monitors import MONITORED, NOT_LEARNT
from etb_hil.controller.uds.learn_stops import LearnStops, RoutineState
from etb_hil.diagnosis.measurement_registry import measurement_kinds
from etb_hil.plant.parameters import Model
from etb_hil.report.unit_codes import codes_line
from etb_hil.results.unit_diagnostics import TroubleCode
from etb_hil.uds.trouble_codes import CODES, code_of_number, number_of_code


def stuck(value="5 N·m"):
    """Return a unit whose friction no motor of its kind can overcome."""
    base = model("default")
    torque = float(value.split()[0])
    values = {"stiction": torque, "coulomb": torque}
    return changed(base, values)


def changed(base: Model, values):
    from dataclasses import replace  # noqa: PLC0415

    parameters = {k: (replace(p, value=values[k]) if k in values else p) for k, p in base.parameters.items()}
    return replace(base, parameters=parameters)


def codes_after(unit, rows, end_s, **options):
    machine = Machine(unit, model("default"), 1, **options)
    drive(machine, rows, end_s)
    return {code for k, code in enumerate(MONITORED) if machine.codes[0] >> k & 1}, machine


def to(angle, end_s):
    return stream(lambda _t: command(Mode.POSITION, math.radians(angle)), end_s)


def test_a_healthy_unit_sets_none():
    rows = to(40.0, 1.0) + [(1_000_000_000 + k * 10_000_000, OFF) for k in range(100)]
    codes, machine = codes_after(model("default"), rows, 2.0)
    assert codes == set()
    assert machine.codes[1] == 0
    assert machine.codes[2] >> MONITORED.index("P2119") & 1  # it was tested


def test_a_plate_that_does_not_come_back_sets_p2119():
    rows = to(40.0, 1.0) + [(1_000_000_000 + k * 10_000_000, OFF) for k in range(100)]
    assert codes_after(model("faulty"), rows, 2.0)[0] == {"P2119"}


@pytest.mark.parametrize(("start", "target", "code"), [(10.0, 40.0, "P2112"), (60.0, 20.0, "P2111")])
def test_a_plate_that_is_stuck_says_which_way(start, target, code):
    codes, _ = codes_after(stuck(), to(target, 1.2), 1.2, start_angle=math.radians(start))
    assert {"P2101", code} <= codes
    assert not codes & ({"P2111", "P2112"} - {code})


def test_tracks_that_disagree_set_p2135():
    codes, _ = codes_after(model("default"), to(10.0, 0.5), 0.5, track_2_offset=0.05)
    assert codes == {"P2135"}


def test_too_much_voltage_for_too_long_sets_p2118():
    rows = stream(lambda _t: command(Mode.VOLTAGE, voltage=11.0), 5.2)
    assert "P2118" in codes_after(model("default"), rows, 5.2)[0]


@pytest.mark.parametrize(("unit", "state"), [("default", RoutineState.DONE), ("stuck", RoutineState.FAILED)])
def test_stops_are_learnt_where_the_plate_reaches_them(unit, state):
    machine = Machine(stuck() if unit == "stuck" else model(unit), model("default"), 1)
    routine = LearnStops(machine, model("default").values)
    routine.start(0)
    now, events = 0, []
    while routine.is_running and now < 10_000_000_000:
        due = routine.step(now)
        events = [] if due is None else [(now, due)]
        drive(machine, events, (now + 1_000_000) * 1e-9)
        now += 1_000_000
    assert routine.state is state
    assert bool(machine.codes[0] & NOT_LEARNT) is (state is RoutineState.FAILED)


def test_every_measurement_of_the_table_exists():
    known = set(measurement_kinds())
    for code, meaning in CODES.items():
        assert known.issuperset(meaning.measurements), code
        assert code_of_number(number_of_code(code)) == code
    assert set(MONITORED) <= set(CODES)


@pytest.mark.parametrize(
    "code",
    [
        "P11_1",
        "P1 11",
        "P0x1",
        "P211",
        "P21199",
        "X2119",
        "P4119",
        "P+119",
        "P21\N{ARABIC-INDIC DIGIT ONE}9",
        "P211G",
        "",
    ],
)
def test_what_is_no_trouble_code_is_refused(code):
    with pytest.raises(ValueError, match="must be a trouble code, such as P2119"):
        number_of_code(code)


def test_codes_in_a_line():
    assert codes_line(None) == "not read"
    assert codes_line(()) == "none"
    assert codes_line((TroubleCode("P2119", 0, 0x2F), TroubleCode("P2135", 0, 0x08))) == "P2119, P2135 (stored)"
