"""How well the estimation core knows an independent throttle: coverage, whiteness, sensitivities, time.

    OPENBLAS_NUM_THREADS=1 python benchmarks/estimation_core.py [--units 10] [--first 0]

For each unit a friction check at 2 kHz is simulated by the independent throttle, the bench's idea of the unit is drawn
inside its tolerances, and its parameters are calibrated. Printed are: by how many nats the fit is more likely than the
truth; the share of parameters whose 95 % interval holds the truth; the disturbance that the fit needs; the correlation
of the innovations from sample to sample; processor time a sample. At the end, sensitivities against differences:
without an effect, and for each effect all unknowns of a record that has it.
"""

import argparse
import time
from dataclasses import fields, replace

import numpy as np
from driven_plant import driven
from held_gains import whitened
from independent_throttle import Unit, friction_check, off_by_tolerances
from throttle_as_model import parameters, record_until_the_bridge_opens

from etb_hil.base.stock import find
from etb_hil.estimation.calibration import calibrated
from etb_hil.estimation.filtering import Column, Disturbance, filtered, sensitivities
from etb_hil.estimation.record import lasting
from etb_hil.estimation.unknown import base_unknowns
from etb_hil.hypotheses.candidates import unknowns_of
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.port import Port
from etb_hil.plant.parameters import load_model
from etb_hil.plant.physics import VISCOUS
from etb_hil.plant.values import ThrottleParameters

RATE = 2000
SMALL = Disturbance(1e-3, 1e-2)
TRANSIENT = 200  # samples at the beginning that are not judged
IN_INTERVAL = 1.96
STRONG = 4.0  # steps of an effect
FAR = 0.02  # of a sensitivity: error that is printed
OFF_THE_EDGE = 1.0 / (3.0 * RATE)  # s: a delay of whole samples has no derivative
LATE = (Port.CURRENT_LATENESS, Port.MOTOR_LATENESS, Port.PLATE_LATENESS)
SMALLER = 1e-4  # than an unknown's step: a damped stop is met with a jump of the torque, which has no derivative
MOVES = 1e-3  # of the innovations that a column changes most: it has to move them by as much to be judged


def judged(seed):
    """Print what one unit comes to; return how far its parameters are off in standard deviations."""
    unit = Unit()
    made, model = record_until_the_bridge_opens(
        unit, off_by_tolerances(unit, np.random.default_rng(seed)), friction_check(unit), RATE, seed
    )
    begin = time.process_time()
    fit = calibrated(made, model.vector(), base_unknowns(model))
    took = time.process_time() - begin
    true = model.vector()
    true[: VISCOUS + 1] = parameters(unit).vector()[: VISCOUS + 1]
    gained = fit.filtered.log_likelihood - filtered(made, true, fit.disturbance).log_likelihood
    seen = [one for one in range(len(fit.unknowns)) if fit.normal.matrix[one, one] > 0.0]
    deviation = np.sqrt(np.diag(fit.covariance))
    away = np.array([(fit.parameters[one.place] - true[one.place]) for one in fit.unknowns]) / deviation
    w = fit.filtered.whitened[TRANSIENT:]
    alike = np.mean(w[1:] * w[:-1], axis=0) / np.mean(w**2, axis=0)
    torque, voltage = fit.filtered.needed
    print(
        f"unit {seed}: {len(made)} samples, {took:.1f} s; fit over truth {gained:+.0f} nats; "
        f"needed {1e3 * torque:.4f} mN·m, {1e3 * voltage:.3f} mV; "
        f"innovations' variance {np.mean(w**2, axis=0).round(2)}, correlation {alike.round(2)}",
        flush=True,
    )
    return away[seen]


def columns(model):
    """Return parameters and a column for every base parameter and every effect's first strength, and its ends.

    An effect is asked where it begins; a delay a third of a sample behind an edge, where it has no derivative.
    """
    found = []
    p = model.vector()
    for place, one in enumerate(fields(ThrottleParameters)):
        if model.tolerance(one.name) > 0.0:
            found.append((p, Column(one.name, 0.001 * model.tolerance(one.name), place), (-1.0, 1.0)))
    for effect in CATALOGUE.values():
        q = p.copy()
        for one, place in zip(effect.parameters, effect.indices, strict=True):
            if not one.is_strength and one.starts:
                q[place] = one.starts[-1]
        first = effect.searched[0]
        place, ends = effect.indices[first], (0.0, 1.0)
        if effect.acts_at(*LATE):
            q[place], ends = OFF_THE_EDGE, (-1.0, 1.0)
        step = 1e-3 * effect.parameters[first].starts[0]
        found.append((q, Column(effect.id, step, place, effect, parameters=q), ends))
    return found


def off(made, at, row, put, ends, step, known=0.0):
    """Return how far a sensitivity (n, 3) is from differences, at fixed gains and with gains that follow.

    Both are shares of the difference, in the reading that changes most; None where that reading tells less than
    `known` of 1. `put` returns the parameters moved by a multiple of the column's step.
    """
    found = []
    for run in (lambda p: whitened(made, at, p), lambda p: filtered(made, p, SMALL).whitened):
        low, high = (run(put(way))[TRANSIENT:] for way in ends)
        difference = (high - low) / ((ends[1] - ends[0]) * step)
        size = np.linalg.norm(difference, axis=0)
        most = int(np.argmax(size))
        if size[most] <= known:
            return None
        found.append(float(np.linalg.norm((row[TRANSIENT:] - difference)[:, most]) / size[most]))
    return found


def moved(p, column):
    """Return what gives parameters moved by a multiple of a column's step."""

    def put(way):
        q = p.copy()
        q[column.place] += way * column.step
        return q

    return put


def late(made, effect):
    """Return a record whose readings are as late as an effect makes them, between samples along straight lines."""
    readings = made.readings.copy()
    for m, port in enumerate(LATE):
        if effect.acts_at(port):
            readings[:, m] = np.interp(made.time - OFF_THE_EDGE, made.time, readings[:, m])
    return replace(made, readings=readings, lasts=lasting(readings[:, 1]))


def compare():
    """Print sensitivities against differences, in the reading that each column changes most."""
    made, model = record_until_the_bridge_opens(Unit(), Unit(), friction_check(Unit()), RATE, 0)
    every = []
    for p, column, ends in columns(model):
        seen = late(made, column.effect) if column.effect else made
        at = filtered(seen, p, SMALL, is_kept=True)
        row = sensitivities(seen, at, [column], is_kept=True).rows[:, :, 0]
        errors = off(seen, at, row, moved(p, column), ends, column.step, MOVES / abs(column.step))
        if errors:
            every.append(errors)
            print(f"  {column.name:28} {100 * errors[0]:6.2f} % {100 * errors[1]:6.2f} %", flush=True)
    summary("sensitivities against differences", np.array(every))


def summary(name, errors):
    """Print what many errors come to, at fixed gains and with gains that follow."""
    for k, gains in enumerate(("at fixed gains", "with gains that follow")):
        median, far = 100 * np.median(errors[:, k]), np.count_nonzero(errors[:, k] > FAR)
        print(f"{name}, {gains}: median {median:.2f} %, {far} of {len(errors)} above {100 * FAR:.0f} %")


def beside():
    """Print the sensitivities of all unknowns that are far from differences, beside each effect."""
    every = []
    for effect in CATALOGUE.values():
        model = load_model(find("model", "default"))
        p = model.vector()
        for one, place in zip(effect.parameters, effect.indices, strict=True):
            first = one.starts[0] if one.starts else 0.0
            p[place] = np.clip(STRONG * first, one.low, one.high) if one.is_strength else one.starts[-1]
        if effect.acts_at(*LATE):
            p[effect.indices[effect.searched[0]]] += OFF_THE_EDGE
        made, _ = driven(model, p, RATE)
        at = filtered(made, p, SMALL, is_kept=True)
        unknowns = [*base_unknowns(model), *unknowns_of(effect, p)]
        asked = [replace(one.column(), step=SMALLER * one.column().step) for one in unknowns]
        rows = sensitivities(made, at, asked, is_kept=True).rows
        far = []
        for k, (one, column) in enumerate(zip(unknowns, asked, strict=True)):

            def put(way, one=one, column=column, p=p):
                q = p.copy()
                one.put(q, p[one.place] + way * column.step)
                return q

            errors = off(made, at, rows[..., k], put, (-1.0, 1.0), column.step, 1.0 / one.deviation)
            if errors:  # the record knows more of it than the prior
                every.append(errors)
                far += [f"{one.name} {100 * errors[0]:.0f} %"] if errors[0] > FAR else []
        print(f"  {effect.id:28} {', '.join(far)}", flush=True)
    summary("beside effects", np.array(every))


def speed():
    """Print the processor time of one pass a sample, without and with sensitivities."""
    made, model = record_until_the_bridge_opens(Unit(), Unit(), friction_check(Unit()), RATE, 0)
    asked = [column for _, column, _ in columns(model)]
    for name, run in (
        ("filter", lambda: filtered(made, model.vector(), SMALL)),
        (f"filter and {len(asked)} sensitivities",
         lambda: sensitivities(made, filtered(made, model.vector(), SMALL, is_kept=True), asked)),
    ):  # fmt: skip
        run()
        begin = time.process_time()
        run()
        print(f"{name}: {1e6 * (time.process_time() - begin) / len(made):.2f} us a sample")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--units", type=int, default=10)
    parser.add_argument("--first", type=int, default=0)
    options = parser.parse_args()
    away = np.concatenate([judged(seed) for seed in range(options.first, options.first + options.units)])
    held = np.abs(away) < IN_INTERVAL
    print(f"95 % intervals hold the truth: {held.sum()} of {len(held)} = {100 * held.mean():.1f} %")
    compare()
    beside()
    speed()


if __name__ == "__main__":
    main()
