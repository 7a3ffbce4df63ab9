"""A record with all that hypotheses about it are compared by."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from etb_hil.estimation.calibration import calibrated
from etb_hil.estimation.climbing import Fitted, begun, climbed
from etb_hil.estimation.kalman import STEP_MOTOR, STEP_PLATE
from etb_hil.estimation.record import Record
from etb_hil.estimation.unknown import Unknown, base_unknowns
from etb_hil.hypotheses.candidates import as_seen, unknowns_of
from etb_hil.hypotheses.constants import ELASTIC_SHARES, OFFSET
from etb_hil.hypotheses.terms import bench_unknowns, with_room, with_terms
from etb_hil.plant.device_effects import effects_of, largest_torque
from etb_hil.plant.effects.effect import Effect
from etb_hil.plant.effects.layout import ELASTIC
from etb_hil.plant.effects.port import Port
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import INDUCTANCE, LIMP_HOME, STOP_HIGH, STOP_LOW
from etb_hil.recording.samples import Float64


@dataclass(frozen=True, slots=True)
class Prepared:
    """A record, the effects that it may show, and the unknowns of a model.

    `parameters`: the whole vector of the model file.
    """

    record: Record
    effects: Mapping[str, Effect]
    unknowns: tuple[Unknown, ...]
    parameters: Float64

    def calibrated(self) -> tuple[Record, Fitted]:
        """Return the record with unsure torque where its stops are, and the model."""
        first = calibrated(self.record, self.parameters, self.unknowns)
        # All hypotheses have the same noise, or their likelihoods could not be compared.
        record = self.record.placed(first.parameters)
        return record, climbed(record, begun(record, first.parameters, self.unknowns, first.disturbance))


def prepared(whole: Record, model: Model) -> Prepared:
    """Return what is compared of a record of a model's device."""
    record = with_terms(whole)
    p = with_room(model.vector())
    effects = effects_of(model, largest_torque(model, record.voltage))
    base = [_as_sampled(one, record, model) for one in base_unknowns(model)]
    seen = as_seen(record, effects, model.values.gear_ratio)
    unknowns = (*base, *bristle_unknowns(p), *bench_unknowns(record), *_stated(model, effects), *_late(record, seen, p))
    return Prepared(record, seen, unknowns, p)


def _as_sampled(unknown: Unknown, record: Record, model: Model) -> Unknown:
    """Return a base parameter with the tolerance that a bench gives it.

    A voltage that is sampled beside its changes is an inductance that is off by that time times the resistance. An
    encoder's zero is known to half of its step, and the positions of stops and limp-home are counted from it.
    """
    if unknown.place == INDUCTANCE:
        off = OFFSET * (record.sampled or float(np.median(record.dt))) * model.values.resistance
    elif unknown.place in (LIMP_HOME, STOP_LOW, STOP_HIGH):
        motor = bool(np.isfinite(record.readings[:, 1]).any())
        off = 0.5 * float(record.settings[STEP_MOTOR if motor else STEP_PLATE])
    else:
        return unknown
    reach = unknown.reach + off
    return replace(unknown, reach=reach, deviation=reach / np.sqrt(3.0))


def bristle_unknowns(parameters: Float64) -> list[Unknown]:
    """Return the elastic share of elasto-plastic bristles, which no file states."""
    share = float(parameters[ELASTIC])
    low, high = ELASTIC_SHARES
    return [Unknown("elastic_share", ELASTIC, share, (high - low) / np.sqrt(12.0), low=low, high=high)] if share else []


def _late(record: Record, effects: Mapping[str, Effect], parameters: Float64) -> list[Unknown]:
    """Return the unknowns of the delay and the lag of a reading that drives.

    They are the bench's, so that each model has them.
    """
    late = [one for one in effects.values() if record.is_read and one.acts_at(Port.CURRENT_LATENESS)]
    return [unknown for effect in late for unknown in unknowns_of(effect, parameters)]


def _stated(model: Model, effects: Mapping[str, Effect]) -> list[Unknown]:
    """Return the unknowns of the model file's own effects, as well as they are known."""
    found, vector = [], model.vector()
    for effect in (effects[entry.id] for entry in model.effects):
        strengths = [effect.indices[k] for k in effect.strengths]
        measured = {one.name: one for one in model.measured.values() if one.id == effect.id}
        for unknown in unknowns_of(effect, vector) if vector[strengths].any() else ():
            if known := measured.get(unknown.name):
                half = known.uncertainty
                found.append(replace(unknown, mean=known.value, deviation=half / np.sqrt(3.0), reach=half))
            elif not measured or unknown.place not in strengths:
                found.append(unknown)
    return found
