"""How often 95 % intervals hold the truth, over random units that the bench's model is not.

Run: python benchmarks/interval_coverage.py [--units 300] [--rate 1000|20000]... [--seed 471]
     [--bump [one|several|broad|dip|rise|ripple|drift]] [--exponent N] [--dwell SHARE] [--hot K]
     [--presliding lugre|elasto-plastic|maxwell-slip|gms] [--track]
One friction check a unit, from the independent generator. Drawn beside the throttle itself: T_st as healthy or risen by
25 or 60 %; motor constant, springs and inertia of the bench's model inside their tolerances; the gain of the current
sensor anywhere within 2 %; K_t against K_e by 0.2 % (one standard deviation): what the intervals claim to cover. With
`--bump`, friction of each unit is locally higher by 15 to 60 %, at 0.3 to 1.2 rad, within 0.03 to 0.08 rad of there;
several: likewise at every 0.2 to 0.4 rad; broad: within 0.15 to 0.5 rad, and as often lower; dip: lower by half of it;
rise: by 20 % a rad all the way, the truth being that of 0 rad; ripple: by 10 to 40 % at every 0.02 to 0.06 rad, within
0.3 of that; drift: none, and friction changes by up to 1 % a second up or down, the truth being that of the middle of
the motion. `uneven way` counts the runs that say so.
Friction is the paper's unless: `--exponent`, it falls like exp(-x^N); `--dwell`, it gains that share of T_st with a
unit of ln(1 + age of the contacts / 50 ms), the truth being that of no age; `--presliding` names what bends before it
slides.
With `--track` a plate track of 12 bits over 90 deg with 0.01 deg of noise takes the place of the encoder.
With `--hot` the motor is by so many kelvin warmer than the housing. Verdicts are held against the true T_st of all
places, T_c, and the least that a spring has over the T_st of its place: a false FAIL has all of them within the stock
limits, a false PASS one beyond.
"""

from __future__ import annotations

import argparse
import math
import time
from collections import Counter
from dataclasses import replace

import numpy as np
from diagnosis_power import COPPER, LIMITS, MAGNETS, RISES, UNIT_SPREAD, healthy_design
from independent_throttle import (
    ELASTO_PLASTIC,
    GMS,
    LUGRE,
    MAXWELL_SLIP,
    SAMPLE_S,
    friction_check,
    off_by_tolerances,
    sense,
)
from throttle_as_model import bench_model, rows_of

from etb_hil.diagnosis.contradiction import GAIN
from etb_hil.diagnosis.diagnosis import Diagnosis

PRESLIDING = {"lugre": LUGRE, "elasto-plastic": ELASTO_PLASTIC, "maxwell-slip": MAXWELL_SLIP, "gms": GMS}
TRACK_STEP, TRACK_NOISE = math.radians(90.0) / 2**12, math.radians(0.01)  # rad
ONE_MOTOR = 0.002  # of K_t against K_e, one standard deviation


def along_the_way(bump, rng):
    """Return what makes friction of a unit another along the way, by its kind."""
    shape = {
        "bump": rng.uniform(0.15, 0.6),
        "bump_angle": rng.uniform(0.3, 1.2),
        "bump_width": rng.uniform(0.03, 0.08),
    }
    if bump == "several":
        shape["bump_every"] = rng.uniform(0.2, 0.4)
    if bump == "broad":
        shape["bump_width"] = rng.uniform(0.15, 0.5)
        shape["bump"] *= rng.choice((1.0, -0.5))
    if bump == "dip":
        shape["bump"] *= -0.5
    if bump == "ripple":
        every = rng.uniform(0.02, 0.06)
        shape |= {"bump": rng.uniform(0.1, 0.4), "bump_every": every, "bump_width": 0.3 * every}
    if bump == "rise":
        shape = {"rise": 0.2}
    if bump == "drift":
        shape = {"drift": rng.uniform(-0.01, 0.01)}
    return shape


def check(rng, rates, *, bump="", law=(), hot=0.0, track=False):
    """Return a drawn unit and what the diagnosis says of it at each rate."""
    nominal = healthy_design(rng)
    bench = bench_model(off_by_tolerances(nominal, rng))
    share = np.exp(UNIT_SPREAD * rng.standard_normal())
    unit = replace(
        nominal,
        coulomb=nominal.coulomb * share,
        stiction=nominal.stiction * share * rng.choice(RISES),
        torque_per_ampere=nominal.torque_per_ampere * (1.0 + ONE_MOTOR * rng.standard_normal()),
    )
    if track:  # the angle's steps, as a model file states them
        counts = {"motor_counts_per_turn": round(2.0 * math.pi / TRACK_STEP / unit.gear_ratio)}
        bench = replace(bench, sensors=bench.sensors.model_copy(update=counts))
    if bump:
        unit = replace(unit, **along_the_way(bump, rng))
    unit = replace(unit, **dict(law))
    magnets = 1.0 + MAGNETS * hot
    unit = replace(
        unit,
        resistance=unit.resistance * (1.0 + COPPER * hot),
        back_emf=unit.back_emf * magnets,
        torque_per_ampere=unit.torque_per_ampere * magnets,
    )
    truth, phases = friction_check(unit)
    gain = 1.0 + GAIN * rng.uniform(-1.0, 1.0)
    results = []
    for rate in rates:
        sensed = sense(unit, truth, rate, rng)
        if track:
            sensed = by_track(unit, sensed, truth.angle[:: round(1.0 / SAMPLE_S / rate)], rng)
        diagnosis = Diagnosis(bench, LIMITS)
        for rows, kind in rows_of(replace(sensed, current=gain * sensed.current), phases, rate):
            diagnosis.push(rows, kind)
        results.append(diagnosis.finish())
    moved = [phase for phase in phases if phase[0] in {"ramp", "dash"}]
    middle = 1.0 + unit.drift * 0.5 * SAMPLE_S * (moved[0][1] + moved[-1][2])
    return replace(unit, coulomb=middle * unit.coulomb, stiction=middle * unit.stiction), results


def by_track(unit, sensed, angle, rng):
    """Return what a plate track tells in the encoder's place; noise is another than that of the plate's own reading."""
    noisy = angle + TRACK_NOISE * rng.standard_normal(len(angle))
    return replace(sensed, motor_angle=np.round(noisy / TRACK_STEP) * TRACK_STEP * unit.gear_ratio)


def collect(rows, unit, result):
    """Add what each interval says: whether it holds the truth, the error, and its half width, as shares."""
    for name, real in (
        ("T_st", unit.stiction),
        ("T_c", unit.coulomb),
        ("omega_s", unit.stribeck_velocity),
        ("viscous", unit.viscous),
    ):
        found = result.measurements.get(name)
        if found is None or found.low is None:
            rows.setdefault(f"{name}: no interval", []).append((True, np.nan, np.nan))
        elif found.is_bound:
            bounded = (found.high >= real, np.nan, found.high / real - 1.0)
            rows.setdefault(f"{name}: bound above only", []).append(bounded)
        else:
            held = found.low <= real <= found.high
            rows.setdefault(name, []).append((held, found.value / real - 1.0, (found.high - found.low) / real / 2.0))


def agreement(stiction, coulomb, margin, result):
    """Return how a verdict agrees with the true highest friction and return margin, in N·m.

    That is right, false FAIL, false PASS or inconclusive.
    """
    of = {name: LIMITS.by_id[name] for name in ("T_st", "T_c", "return_margin")}
    within = stiction <= of["T_st"].high and coulomb <= of["T_c"].high and margin >= of["return_margin"].low
    if result.verdict == "inconclusive":
        return "inconclusive"
    return "right" if bool(within) == (result.verdict == "pass") else f"false {result.verdict.upper()}"


def agreement_of(unit, result):
    """Return how the verdict on a unit agrees with the truth, see `agreement`.

    A place beyond a limit fails a unit as well.
    """
    angles = np.arange(unit.stop_low, unit.stop_high, 1e-3)
    away = angles - unit.bump_angle
    if unit.bump_every > 0.0:
        away -= unit.bump_every * np.round(away / unit.bump_every)
    stiction = unit.stiction * (1.0 + unit.rise * angles) * (1.0 + unit.bump * np.exp(-((away / unit.bump_width) ** 2)))
    distance = angles - unit.limp_home
    springs = np.where(
        distance > 0.0,
        unit.preload_open + unit.slope_open * distance,
        unit.preload_close - unit.slope_close * distance,
    )
    return agreement(stiction.max(), unit.coulomb, (springs - stiction).min(), result)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--units", type=int, default=300)
    parser.add_argument("--rate", type=int, choices=(1000, 20000), action="append", help="default: both")
    parser.add_argument("--seed", type=int, default=471)
    kinds = ("one", "several", "broad", "dip", "rise", "ripple", "drift")
    parser.add_argument("--bump", choices=kinds, nargs="?", const="one", default="", help="in every unit")
    parser.add_argument("--exponent", type=float, default=2.0, help="of the Stribeck curve")
    parser.add_argument("--dwell", type=float, default=0.0, help="share of T_st a unit of the age's logarithm")
    parser.add_argument("--presliding", choices=PRESLIDING, default="lugre")
    parser.add_argument("--hot", type=float, default=0.0, help="K by which the motor is warmer than the housing")
    parser.add_argument("--track", action="store_true", help="a plate track of 12 bits in place of the encoder")
    options = parser.parse_args()
    law = {"exponent": options.exponent, "dwell": options.dwell, "law": PRESLIDING[options.presliding]}
    rates = options.rate or (20000, 1000)
    start, tables, uneven = time.perf_counter(), [{} for _ in rates], [0 for _ in rates]
    agreements = [Counter() for _ in rates]
    for number in range(options.units):
        unit, results = check(
            np.random.default_rng([options.seed, number]),
            rates,
            bump=options.bump,
            law=law,
            hot=options.hot,
            track=options.track,
        )
        for k, result in enumerate(results):
            collect(tables[k], unit, result)
            uneven[k] += any(reason.id == "uneven_way" for reason in result.reasons)
            agreements[k][agreement_of(unit, result)] += 1
        if (number + 1) % 50 == 0 or number + 1 == options.units:
            for rate, table, said, verdicts in zip(rates, tables, uneven, agreements, strict=True):
                seconds = time.perf_counter() - start
                print(f"{number + 1} units at {rate} Hz, {seconds:.0f} s, uneven way {said}, verdicts {dict(verdicts)}")
                for name, kept in table.items():
                    held, off, width = np.array(kept).T
                    print(
                        f"  {name:22} {len(held):4d}  cover {np.mean(held):.1%}  bias {np.mean(off):+.2%}  "
                        f"rms {np.sqrt(np.mean(off**2)):.2%}  half width, median {np.median(width):.2%}",
                        flush=True,
                    )


if __name__ == "__main__":
    main()
