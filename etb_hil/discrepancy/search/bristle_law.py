"""Choose the law of bristles where a residual remains by that of the model file.

Healthy units have bristles of several laws.
"""

from __future__ import annotations

from dataclasses import replace

from etb_hil.discrepancy.search.findings import Bristles, Findings
from etb_hil.estimation.calibration import first_disturbance, settled
from etb_hil.estimation.climbing import begun
from etb_hil.hypotheses.constants import GAIN
from etb_hil.hypotheses.prepared import bristle_unknowns
from etb_hil.plant.effects.layout import ELASTIC
from etb_hil.plant.model_file import FrictionModel
from etb_hil.plant.parameters import Model


def elasto_plastic(model: Model) -> Model:
    """Return a model with elasto-plastic bristles."""
    return replace(model, friction_model=FrictionModel.ELASTO_PLASTIC)


def likeliest_law(findings: Findings, other: Model) -> Bristles | None:
    """Return the law by which what was found is likelier than by the model's.

    None where no other law is likelier.

    `other`: the model with elasto-plastic bristles.
    """
    if findings.found is None or not findings.model.device.is_throttle:
        return None
    record, final = findings.found.record, findings.found.final
    unknowns, p = list(final.unknowns), final.parameters.copy()
    laws = {Bristles.OPEN: record.with_open_bristles()}
    if findings.model.friction_model is FrictionModel.LUGRE:
        p[ELASTIC] = other.vector()[ELASTIC]
        unknowns += bristle_unknowns(p)
        laws = {Bristles.ELASTO_PLASTIC: record, **laws}
    most, likeliest = final.posterior, None
    for law, seen in laws.items():
        posterior = settled(seen, begun(seen, p, unknowns, first_disturbance(p))).posterior
        if posterior > most + GAIN:
            most, likeliest = posterior, law
    return likeliest


def is_likelier(findings: Findings, others: Findings) -> bool:
    """Tell whether the final model of `others` is likelier than that of some findings."""
    if findings.found is None or others.found is None:
        return False
    its, theirs = findings.found.final, others.found.final
    # Each search chooses samples of its own: evidences are compared on the same ones.
    record = replace(others.found.record, settings=findings.found.record.settings)
    there = settled(record, begun(record, its.parameters, its.unknowns, its.disturbance))
    return theirs.evidence > there.evidence + GAIN


def named(findings: Findings) -> list[tuple[str, set[str]]]:
    """Return what findings name, each with its ambiguity group."""
    return [(one.winner.id, set(one.ambiguity_group)) for one in findings.accepted]
