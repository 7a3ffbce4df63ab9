"""A recording judged: friction and all else that it tells of the unit, against limits."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from etb_hil.base.errors import InputError, Problem

if TYPE_CHECKING:
    from etb_hil.diagnosis.limits import Limits
    from etb_hil.diagnosis.result import DiagnosisResult
    from etb_hil.plant.parameters import Model
    from etb_hil.recording.recording import Recording

NEEDED = ("motor_current", "motor_angle")


def diagnose(
    recording: Recording,
    *,
    model: Model | str | Path = "default",
    limits: Limits | str | Path = "default",
    observer: str | None = None,
) -> DiagnosisResult:
    """Judge the unit in a recording as a log without phases: all of it is taken for motion under the bridge.

    Needs the roles `motor_current` and `motor_angle`. A session has phases, which `Run.open` and `replay` go by: of its
    recording alone the zero of the current is not known. Raises InputError where a role is missing or a file is wrong.
    """
    from etb_hil.api.models import as_limits, as_model
    from etb_hil.diagnosis.diagnosis import Diagnosis
    from etb_hil.diagnosis.phase_use import RunPhase, Use
    from etb_hil.diagnosis.plausibility import Plausibility
    from etb_hil.observer.registry import DEFAULT
    from etb_hil.scenario.phases import LOG
    from etb_hil.session.analysis import SLOW_ROLES
    from etb_hil.session.rows import RowBuilder
    from etb_hil.session.verdict_policy import withheld

    judged_by = as_model(model)
    if missing := [role for role in NEEDED if role not in recording.roles]:
        what = f"{recording.origin} has no {' and no '.join(missing)}, which friction is told from"
        raise InputError(Problem(what, allowed=", ".join(NEEDED), remedy="name its column in a map file"))
    diagnosis = Diagnosis(judged_by, as_limits(limits), observer or DEFAULT)
    plausibility = Plausibility(judged_by)
    joined = list(dict.fromkeys(recording.source_of(role) for role in NEEDED))
    slow = {role: recording.source_of(role) for role in SLOW_ROLES if role in recording.roles}
    rows = RowBuilder(joined, slow).push(recording.block(source) for source in recording.sources)
    if rows is not None:
        diagnosis.push(rows, RunPhase(0, LOG, LOG, Use.FITTED))
        plausibility.push(rows, 0, moving=True)
    return withheld(diagnosis.finish(), plausibility.doubts())
