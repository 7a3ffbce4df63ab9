"""What a run does not measure is said with what it lacks: each measurement of the registry, role by role and phase by
phase."""

from dataclasses import replace

import numpy as np
import pytest
from pushed_rows import pushed_rows

from etb_hil.base.outcome import UnitVerdict
from etb_hil.base.roles import ROLES
from etb_hil.diagnosis.diagnosis import Diagnosis
from etb_hil.diagnosis.limits import Limit, Limits
from etb_hil.diagnosis.measurement_registry import measurement_kinds

KINDS = measurement_kinds()
ROLES_NAMED = sorted({role for kind in KINDS.values() for role in kind.roles})
PHASES_NAMED = sorted({phase for kind in KINDS.values() for phase in kind.phases})
EVERY = Limits("A-1", "1", 0.0, {name: Limit(high=1e9) for name in KINDS})


@pytest.fixture(scope="module")
def pushed():
    """Return the rows of an end-of-line run with their phases, and the model of the bench."""
    return pushed_rows()


def judged(pushed, *, without_role="", without_phase=""):
    found, model = pushed
    diagnosis = Diagnosis(model, EVERY)
    for rows, phase in found:
        if phase.kind != without_phase:
            columns = {role: column for role, column in rows.columns.items() if role != without_role}
            diagnosis.push(replace(rows, columns=columns), phase)
    return diagnosis.finish()


def measured(result):
    """Return the ids of the kinds that were measured."""
    names = [name for name, one in result.measurements.items() if one.value is not None]
    return {max((kind for kind in KINDS if f"{name}_".startswith(f"{kind}_")), key=len) for name in names}


@pytest.fixture(scope="module")
def whole(pushed):
    return measured(judged(pushed))


@pytest.mark.parametrize("role", ROLES_NAMED)
def test_a_missing_role_is_named_by_each_measurement_that_declares_it(pushed, whole, role):
    result = judged(pushed, without_role=role)
    reasons = {reason.id: reason for reason in result.reasons}
    is_contradicted = "spring_elsewhere" in reasons  # without the plate sensor nothing says where the encoder begins
    for kind in KINDS.values():
        if role in kind.roles:
            reason = reasons[f"{kind.id}_without_signal"]
            assert f"{role} ({ROLES[role].meaning})" in reason.text, kind.id
            assert kind.id not in measured(result)
        elif kind.is_model_free or not is_contradicted:
            assert kind.id in measured(result) or kind.id not in whole, f"{kind.id} needs {role} and does not say so"


@pytest.mark.parametrize("phase", PHASES_NAMED)
def test_a_missing_kind_of_phase_is_named_by_each_measurement_that_declares_it(pushed, whole, phase):
    result = judged(pushed, without_phase=phase)
    remark = next((reason.text for reason in result.reasons if reason.id == "limits_not_judged"), "")
    for kind in KINDS.values():
        if kind.phases == {phase}:
            assert f"{kind.name} ({phase})" in remark
            assert kind.id not in measured(result)
        elif not kind.phases and kind.id in whole - measured(result):
            assert any(kind.id in reason.text or reason.id.startswith(kind.id) for reason in result.reasons), kind.id


def test_what_the_motion_does_not_show_is_not_called_a_missing_curve(pushed, whole):
    reasons = {reason.id: reason.text for reason in judged(pushed).reasons}
    assert "too_little_motion" not in reasons
    for name in KINDS.keys() - whole:
        assert "was not measured" in reasons[f"{name}_not_measured"]


def test_a_plate_that_did_not_move_in_a_phase_passes_nothing_that_is_measured_in_it(pushed):
    """A plate that stays at limp-home is there at once after the bridge is switched off, and with no spread."""
    found, model = pushed
    names = ["step_rise", "step_settling", "return_time_open", "return_time_closed"]
    names += ["default_position", "default_position_spread"]
    diagnosis = Diagnosis(model, Limits("A-1", "1", 0.0, {name: Limit(high=1e9) for name in names}))
    at_limp_home = {"motor_angle": model.values.limp_home * model.values.gear_ratio}
    at_limp_home["throttle_angle"] = model.values.limp_home
    for rows, phase in found:
        stuck = at_limp_home if phase.kind in {"step", "release"} else {}
        columns = {role: np.full(len(rows), stuck[role]) if role in stuck else c for role, c in rows.columns.items()}
        diagnosis.push(replace(rows, columns=columns), phase)
    result = diagnosis.finish()
    passed = [one.id for one in result.measurements.values() if one.verdict is UnitVerdict.PASS]
    assert (result.verdict, passed) == (UnitVerdict.INCONCLUSIVE, [])
    said = {reason.id for reason in result.reasons}
    steps = [f"{size}_{way}" for size in ("small", "large") for way in ("opening", "closing")]
    assert said >= {f"{name}_{step}_not_measured" for name in names[:2] for step in steps}
    assert said >= {f"{name}_not_measured" for name in names[2:]}
