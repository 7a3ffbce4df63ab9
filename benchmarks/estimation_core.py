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
from independent_throttle import Unit, friction_check, off_by_tolerances
from throttle_as_model import parameters, record_until_the_bridge_opens

from etb_hil.base.stock import find
from etb_hil.estimation.calibration import calibrated
from etb_hil.estimation.filtering import Column, Disturbance, filtered, sensitivities
from etb_hil.estimation.unknown import base_unknowns
from etb_hil.hypotheses.candidates import unknowns_of
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.parameters import load_model
from etb_hil.plant.physics import VISCOUS
from etb_hil.plant.values import ThrottleParameters

RATE = 2000
SMALL = Disturbance(1e-3, 1e-2)
TRANSIENT = 200  # samples at the beginning that are not judged
IN_INTERVAL = 1.96
STRONG = 4.0  # steps of an effect
FAR = 0.1  # of a sensitivity: error that is printed
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
    """Return a column for every base parameter and every effect's first strength, moved by a thousandth."""
    p = model.vector()
    for place, one in enumerate(fields(ThrottleParameters)):
        if model.tolerance(one.name) > 0.0:
            yield p, Column(one.name, 0.001 * model.tolerance(one.name), place)
    for effect in CATALOGUE.values():
        q = p.copy()
        for one, place in zip(effect.parameters, effect.indices, strict=True):
            if not one.is_strength and one.starts:
                q[place] = one.starts[-1]
        first = effect.searched[0]
        step = 1e-3 * effect.parameters[first].starts[0]
        yield q, Column(effect.id, step, effect.indices[first], effect, parameters=q)


def compare():
    """Print sensitivities against differences, in the reading that each column changes most."""
    made, model = record_until_the_bridge_opens(Unit(), Unit(), friction_check(Unit()), RATE, 0)
    at = filtered(made, model.vector(), SMALL, is_kept=True)
    errors = []
    for p, column in columns(model):
        found = sensitivities(made, at, [column], is_kept=True).rows[TRANSIENT:, :, 0]
        moved = p.copy()
        moved[column.place] += column.step
        difference = (filtered(made, moved, SMALL).whitened - at.whitened)[TRANSIENT:] / column.step
        size = np.linalg.norm(difference, axis=0)
        most = int(np.argmax(size))
        if size[most] * column.step > MOVES:
            errors.append(float(np.linalg.norm((found - difference)[:, most]) / size[most]))
            print(f"  {column.name:28} {100 * errors[-1]:6.2f} %")
    print(f"sensitivities against differences: median {100 * np.median(errors):.2f} %, worst {100 * max(errors):.1f} %")


def beside():
    """Print the sensitivities of all unknowns that are far from differences, beside each effect."""
    every = []
    for effect in CATALOGUE.values():
        model = load_model(find("model", "default"))
        p = model.vector()
        for one, place in zip(effect.parameters, effect.indices, strict=True):
            first = one.starts[0] if one.starts else 0.0
            p[place] = np.clip(STRONG * first, one.low, one.high) if one.is_strength else one.starts[-1]
        made, _ = driven(model, p, RATE)
        at = filtered(made, p, SMALL, is_kept=True)
        unknowns = [*base_unknowns(model), *unknowns_of(effect, p)]
        asked = [replace(one.column(), step=0.1 * one.column().step) for one in unknowns]
        rows = sensitivities(made, at, asked, is_kept=True).rows[TRANSIENT:]
        far = []
        for k, (one, column) in enumerate(zip(unknowns, asked, strict=True)):
            ends = []
            for way in (-1.0, 1.0):
                moved = p.copy()
                one.put(moved, p[one.place] + way * column.step)
                ends.append(filtered(made, moved, SMALL).whitened[TRANSIENT:])
            difference = (ends[1] - ends[0]) / (2.0 * column.step)
            size = np.linalg.norm(difference, axis=0)
            most = int(np.argmax(size))
            if size[most] * one.deviation > 1.0:  # what the record knows more of than the prior
                every.append(float(np.linalg.norm((rows[..., k] - difference)[:, most]) / size[most]))
                far += [f"{one.name} {100 * every[-1]:.0f} %"] if every[-1] > FAR else []
        print(f"  {effect.id:28} {', '.join(far)}")
    print(f"beside effects: {len(every)}, median {100 * np.median(every):.2f} %, {sum(e > FAR for e in every)} far off")


def speed():
    """Print the processor time of one pass a sample, without and with sensitivities."""
    made, model = record_until_the_bridge_opens(Unit(), Unit(), friction_check(Unit()), RATE, 0)
    asked = [column for _, column in columns(model)]
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
