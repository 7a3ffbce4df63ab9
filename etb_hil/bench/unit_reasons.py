"""Texts of the reasons for a verdict on the unit, by reason id.

Reasons that a limit gives are not here: they are made from the declaration of the measurement.
"""

from __future__ import annotations

from etb_hil.bench.reason_text import REPLACE, Wording

_NOT_FITTED = "Do not fit this unit to a vehicle. " + REPLACE
_SENSORS = "Check the unit's plug and the sensor's wiring, then repeat. This says nothing of the unit's friction."
_OTHER = "Check that model file, bench file and unit belong together, then repeat."
AGAIN = "Repeat the test. Where it happens again, have an engineer look at the plots."

UNIT_REASONS = {
    "T_st_exceeded": Wording("The plate sticks at one place: friction there is above the limit.", REPLACE, True),
    "return_margin_local": Wording(
        "The return spring has too little margin over friction at one place of the way.", _NOT_FITTED, True
    ),
    "plate_stuck": Wording("The plate is stuck: the motor pushed and it did not move.", _NOT_FITTED, True),
    "T_st_unexplained": Wording(
        "The friction estimate was above the limit for a while; no cause was found.", AGAIN, True
    ),
    "T_c_unexplained": Wording(
        "The friction estimate was above the limit in fast motion; no cause was found.", AGAIN, True
    ),
    "resistance_contradicts": Wording("The motor's resistance is not what the model says.", _OTHER, True),
    "back_emf_contradicts": Wording("The motor is not what the model says.", _OTHER, True),
    "angle_reversed": Wording(
        "The angle moves against the motor: the sign of the angle or of the current is reversed, or the motor's leads "
        "are.",
        "Check the signs of angle, current and voltage in the bench's DBC file and roles, and the wiring of sensors "
        "and motor, then repeat. This says nothing of the unit's friction.",
        True,
    ),
    "spring_elsewhere": Wording("Springs or stops are not where the model says.", _OTHER, True),
    "pushed_at_turn": Wording(
        "Where the plate turned back, a stop is not where the model says, or friction is higher.",
        "Check by hand where the stops are. If they are where the model says, look for dirt or wear at that end.",
        True,
    ),
    "motor_hot": Wording(
        "The motor differs from the model as if much warmer than its housing. Worn brushes look the same.",
        "Let the unit cool for 10 minutes, then repeat. If this remark stays, check the brushes.",
        True,
    ),
    "another_friction_law": Wording(
        "Friction does not follow the law of the model. The intervals of the numbers hold that.", "Nothing to do.", True
    ),
    "friction_by_no_law": Wording(
        "Friction over speed goes by no known law. Sliding friction is known by an upper bound alone.",
        "Have an engineer look at the friction over speed in the report; repeating the test does not help.",
        True,
    ),
    "model_contradicted": Wording("The unit differs from the model in more than friction.", _OTHER, True),
    "uneven_way": Wording(
        "Friction is uneven along the way: {friction_least} at {friction_least_at}, {friction_most} at "
        "{friction_most_at} in slow motion. The intervals of the numbers hold that.",
        "Have an engineer look at the friction over angle in the report; repeating the test does not help.",
    ),
    "friction_drifts": Wording(
        "Friction changed while the test ran. The intervals of the numbers hold that.",
        "Let the unit come to a steady temperature, or run it in, as warm_check does; then repeat.",
        True,
    ),
    "too_few_windows": Wording(
        "The samples have too many gaps, or come too slowly, to measure friction.",
        "Check the CAN wiring and the rate that the bench asks for, then repeat.",
        True,
    ),
    "T_st_local_undecided": Wording(
        "Friction at one place of the way is too close to the limit of break-away friction to tell.",
        "Have an engineer look at the friction over angle in the report.",
        True,
    ),
    "return_margin_local_undecided": Wording(
        "The return spring's margin over friction at one place of the way is too close to its limit to tell.",
        "Have an engineer look at the friction over angle in the report.",
        True,
    ),
    "direction_undecided": Wording(
        "Friction may be above its limit in one direction of motion, or the springs are not what the model says.",
        "Measure the springs' preloads, or have an engineer correct the model's; repeating the test does not help.",
        True,
    ),
    "temperature_unknown": Wording(
        "The limits follow the temperature, and none was measured.",
        "Check that the bench reads a temperature and that the scenario has a current_zero, then repeat.",
        True,
    ),
    "measurement_failed": Wording(
        "A measurement of a plug-in failed and has no value; its note in the report says why.",
        "Have an engineer correct the plug-in.",
    ),
    "limits_not_judged": Wording(
        "Some limits were not judged: this run has no phase that shows them.",
        "Run a scenario that has those phases, as end_of_line has them.",
        True,
    ),
    "T_c_not_reached": Wording(
        "The plate never moved fast enough to tell sliding friction.",
        "Run a scenario with fast dashes through limp-home, as friction_check has them.",
        True,
    ),
    "places_not_seen": Wording(
        "The plate did not slide slowly over a wide part of its way; break-away friction may be different there.",
        "Run a scenario with slow ramps over the whole way, as friction_check has them. Where this one has them, check "
        "the CAN wiring for lost frames, and the model's stops.",
        True,
    ),
    "stiction_hidden": Wording(
        "Break-away friction may be higher in slower motion than this run had.",
        "Run a scenario with slower motion, as break_away has it, and with fast dashes.",
        True,
    ),
    "break_away_above": Wording(
        "The plate took more torque to break away than its friction curve has: break-away friction is that, at least.",
        "Have an engineer look at the break-aways in the report: friction rises in slow motion, or with the rest.",
        True,
    ),
    "break_away_not_read": Wording(
        "No break-away was read in both directions; break-away friction is that of the friction curve.",
        "Look at the angle in the report's plots: a coarse angle hides break-aways, and a plate that sticks jumps.",
        True,
    ),
    "one_way": Wording(
        "The plate was measured in one direction only; this does not distinguish springs from friction.",
        "Run a scenario that opens and closes the plate, as friction_check does.",
        True,
    ),
    "read_too_seldom": Wording(
        "The unit is asked for its motor current or angle, and too seldom to tell.",
        "Have an engineer shorten 'every' in the bench file's 'uds' section, or map a cyclic frame; repeating the test "
        "does not help.",
        True,
    ),
    "read_by_request": Wording(
        "The unit was asked for its motor current or angle; intervals hold what that costs.",
        "Where they are too wide, have an engineer map a cyclic frame.",
    ),
    "samples_lost": Wording(
        "Too many samples were lost to judge the unit.", "Check the CAN wiring and the bus load, then repeat.", True
    ),
    "no_samples": Wording(
        "No phase of this run moved the plate and measured current and angle.",
        "Run a scenario that does, as friction_check. Where this one should have, check its measurement request and "
        "the CAN wiring.",
    ),
    "too_little_motion": Wording(
        "The plate moved too little to measure friction.",
        "Check that the plate moves by hand with the supply off, the supply voltage, and that the scenario has ramps "
        "and dashes; then repeat.",
        True,
    ),
    "tracks_disagree": Wording("The two tracks of the plate sensor contradict each other.", _SENSORS, True),
    "angles_disagree": Wording("Plate sensor and motor encoder contradict each other.", _SENSORS, True),
    "angle_jumps": Wording("The motor angle jumps as no motor can move it.", _SENSORS, True),
    "current_frozen": Wording("The current reading stands still.", _SENSORS, True),
    "current_zero_moves": Wording("The current reading with the drive off moves.", _SENSORS, True),
    "motor_balance": Wording("Voltage, current and speed of the motor contradict each other.", _SENSORS, True),
    "samples_missing": Wording(
        "Too many samples are missing to judge the unit.", "Check the CAN wiring and the bus load, then repeat.", True
    ),
    "not_as_asked": Wording(
        "The controller did not measure what was requested.",
        "Check that no other tool sends measurement requests on this bus, then repeat.",
        True,
    ),
    "clocks_disagree": Wording(
        "The clocks of controller and computer drift apart.",
        "Repeat the test. Where it happens again, check the controller's clock.",
        True,
    ),
    "frames_corrupted": Wording(
        "Too many frames were corrupted to trust the others.",
        "Check CAN wiring, termination and shielding, then repeat.",
        True,
    ),
    "run_not_finished": Wording("The run ended before the unit could be judged.", "Repeat the test."),
}
