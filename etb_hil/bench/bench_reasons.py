"""Texts of bench faults and aborted runs, by reason id."""

from __future__ import annotations

from etb_hil.bench.reason_text import Wording

BENCH_REASONS = {
    "no_answer": Wording(
        "The controller did not answer.", "Check its supply, the CAN plug and the bench's bit rate, then repeat."
    ),
    "wrong_unit": Wording(
        "The unit reports another identity than the station expects.",
        "Check the label and the part that was chosen, then scan again.",
        True,
    ),
    "uds_no_answer": Wording(
        "The unit did not answer the bench's diagnostic request in time.",
        "Check the identifiers of the bench file's 'uds' section and the unit's supply, then repeat.",
        True,
    ),
    "uds_bad_answer": Wording(
        "The unit's diagnostic answer breaks the protocol.",
        "Check the CAN wiring and that no other tool talks to the unit, then repeat.",
        True,
    ),
    "uds_refused": Wording(
        "The unit refused a diagnostic request.",
        "Have an engineer check session, security access and identifiers of the bench file's 'uds' section.",
        True,
    ),
    "uds_second_tester": Wording(
        "Another diagnostic tester sends requests to the unit.", "Unplug the other tester, then repeat.", True
    ),
    "uds_routine": Wording(
        "A routine of the unit did not end.", "Check with the supply off that the plate moves freely.", True
    ),
    "controller_overcurrent": Wording(
        "The run ended early: the controller took the drive off because of too much current.",
        "Check with the supply off whether the plate moves freely by hand.",
    ),
    "cut_short": Wording(
        "The run was cut short before it left results.", "Check that the drive is off, then repeat the test."
    ),
    "frames_stopped": Wording(
        "The controller's frames stopped arriving.", "Check the CAN plug, the supply and the termination, then repeat."
    ),
    "answers_late": Wording(
        "The controller answers late, or does not do as it is told.",
        "Check what lies between the bench and the controller (gateways, adapters), and whether the controller's own "
        "release is given, then repeat.",
    ),
    "clock_stepped": Wording(
        "The computer's clock was set while the test ran.", "Repeat the test while the clock is left alone."
    ),
    "not_recorded": Wording(
        "The bench could not write what it measured.", "Make room on its disk, then repeat the test.", True
    ),
    "stopped_by_operator": Wording("The operator stopped the run.", "Repeat the test when the bench is clear."),
    "aborted_by_operator": Wording("The operator aborted the run.", "Repeat the test when the bench is clear."),
    "time_out": Wording(
        "The run ended: it took longer than its time-out.",
        "Find out what it waited for, or give it more time; then repeat.",
    ),
    "part_failed": Wording(
        "The bench stopped the run: a plug-in, or a value from a file, failed.",
        "Have an engineer correct what is named, then repeat.",
        True,
    ),
    "bus_fault": Wording("The CAN interface failed.", "Check the adapter, its driver and the CAN plug, then repeat."),
    "duration_limit": Wording(
        "The bench stopped the run: it took longer than the bench allows.",
        "Have an engineer check the scenario against the bench's limits.",
    ),
    "bus_off": Wording(
        "The CAN interface went bus-off.", "Check wiring, termination and bit rate of the bench, then repeat."
    ),
    "safe_state_not_verified": Wording(
        "The bench could not see that the drive is off.",
        "Switch the supply off before you touch the unit. Then check the CAN plug and the current sensor's zero, and "
        "repeat.",
    ),
    "golden_unit_wrong": Wording(
        "The golden unit did not come out as expected: this bench may judge no unit.",
        "Judge no unit on this bench. Find out why, then measure the golden unit again.",
        True,
    ),
    "set_point_limit": Wording(
        "The bench stopped the run before it sent a set-point outside its limits.",
        "Have an engineer check the scenario against the bench's limits.",
    ),
    "current_limit": Wording(
        "The bench stopped the run: the motor current passed the bench's limit.",
        "Check that the plate moves freely by hand with the supply off, then repeat.",
    ),
    "voltage_limit": Wording(
        "The bench stopped the run: the motor voltage passed the bench's limit.",
        "Check the supply against the bench file, then repeat.",
    ),
    "velocity_limit": Wording(
        "The bench stopped the run: the plate passed the bench's speed limit.",
        "Have an engineer check the scenario against the bench's limits.",
    ),
    "angle_limit": Wording(
        "The bench stopped the run: the plate left the range of angles that the bench allows.",
        "Check the homing and the mounting of the unit, then repeat.",
    ),
    "temperature_limit": Wording(
        "The bench stopped the run: the housing is hotter than the bench allows.", "Let the unit cool, then repeat."
    ),
    "controller_fault": Wording(
        "The controller reported a fault and left the run.", "Switch the controller off and on, then repeat."
    ),
    "host_late": Wording(
        "The computer was not in time with its commands, and the controller's watchdog took the drive off.",
        "Close what else runs on this computer, then repeat. This says nothing of the unit.",
        True,
    ),
    "interlock_open": Wording(
        "The interlock was open, so that the drive was switched off.", "Close the guard, then repeat the test."
    ),
    "interlock_silent": Wording(
        "The bench stopped the run: nothing was heard of the interlock.",
        "Check the device that reports the guard, and its message in the bench file, then repeat.",
        True,
    ),
    "supply_window": Wording(
        "The bench stopped the run: the supply left the scenario's window.",
        "Check the supply and its cables, then repeat.",
    ),
    "condition_never_true": Wording(
        "A phase timed out: its condition was never met.",
        "Check what the scenario waits for, then repeat.",
    ),
    "stopped_by_answer": Wording(
        "The run was ended by the operator's answer.", "Correct what was requested, then repeat."
    ),
    "nobody_answered": Wording("Nobody answered the scenario's question.", "Repeat the test with somebody at it."),
}
