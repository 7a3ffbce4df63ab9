"""The effect of an extended model on the diagnosis: T_st, T_c and the verdict."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from etb_hil.diagnosis.diagnosis import Diagnosis
from etb_hil.diagnosis.limits import Limits
from etb_hil.diagnosis.phase_use import RunPhase, Use
from etb_hil.diagnosis.result import DiagnosisResult
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.search.extended_model import extended_model
from etb_hil.discrepancy.search.findings import Findings
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import Vector
from etb_hil.recording.samples import SampleBlock
from etb_hil.results.explained.models import Consequence, JudgedMeasurement, Judgement

_MOTION = RunPhase(0, "log", "log", Use.FITTED)  # of a record that says nothing of its phases

Judge = Callable[[Model], DiagnosisResult]


def consequence(findings: Findings, limits: Limits, whole: Vector, judge: Judge | None = None) -> Consequence | None:
    """Return the diagnosis under reference and extended model; None without a current.

    `whole`: the vector of the extended one. `judge`: how the bench judges this record, if the bench made it; of another
    nothing is known of its phases. A diagnosis that fails is said: the result of a long search stays.
    """
    if any(b.measured.current is None or not b.measured.device.is_throttle for b in findings.balances):
        return None
    try:
        judge = judge or (lambda model: _judged(findings.balances, model, limits))
        stated, extended = _said(judge(findings.model)), _said(judge(extended_model(findings, whole)))
    except Exception as error:  # noqa: BLE001 (whatever odd data do to a judgement, the causes are found and hold)
        return Consequence(f"the unit could not be judged: {type(error).__name__}: {error}")
    says = (
        f"the verdict stays: {extended.verdict}"
        if stated.verdict == extended.verdict
        else f"the verdict was {stated.verdict} with the reference model, and is {extended.verdict} with the causes"
    )
    return Consequence(says, stated, extended)


def _judged(balances: list[Balances], model: Model, limits: Limits) -> DiagnosisResult:
    diagnosis = Diagnosis(model, limits)
    for b in balances:
        m = b.measured
        time_ns = np.round((m.start_s + np.arange(len(m)) * m.dt) * 1e9).astype(np.int64)
        motor, plate = m.motor_and_plate
        if motor is None:  # the plate's angle stands for it
            motor, plate = m.angle, None
        columns = {"motor_voltage": m.voltage, "motor_angle": motor * b.gear, "temperature": m.temperature}
        if m.current is not None:
            columns["motor_current"] = m.current
        if plate is not None:
            columns["throttle_angle"] = plate
        diagnosis.push(SampleBlock(m.origin, time_ns, time_ns, columns, np.zeros(len(m), np.int64)), _MOTION)
    return diagnosis.finish()


def _said(result: DiagnosisResult) -> Judgement:
    friction = {
        id_: JudgedMeasurement(one.value, one.unit, (one.low, one.high))
        for id_ in ("T_st", "T_c")
        if (one := result.measurements.get(id_)) is not None and one.is_known
    }
    return Judgement(str(result.verdict), tuple(reason.text for reason in result.reasons), friction)
