"""Contradictions and ambiguities of the seed paper, and how they are read.

Each place has the reading taken, and what the other one gives.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from etb_hil.base.stock import stock_file
from etb_hil.paper.estimation import CUTOFF, MARGIN, estimate, numbers_of, paper_settings
from etb_hil.paper.properties import bounded_bristles, passage
from etb_hil.paper.setups import (
    Motion,
    controlled,
    faulty,
    friction_torque,
    healthy,
    literal_fault,
    sinusoid,
)
from etb_hil.plant.parameters import ThrottleParameters, load_model
from etb_hil.plant.reach import peak_velocities
from etb_hil.plant.values import FAR_ABOVE

_RUN_S = 2.0
_NO_FILTER = 1e9  # Hz


@dataclass(frozen=True, slots=True)
class Reading:
    """One unclear place, the reading taken, and what the other reading gives.

    The reading says where the place is and what is printed there.
    """

    place: str
    printed: str
    taken: str
    other: str


def readings(normal: Motion, fault: Motion) -> Sequence[Reading]:
    """Return every unclear place, with the numbers of its other reading.

    The motions are those of figures 4 and 6.
    """
    return (
        *_parameters(normal),
        *_estimator(normal, fault),
        *_properties(),
    )


def _parameters(normal: Motion) -> list[Reading]:
    unit, fault = healthy(), faulty()
    literal = load_model(stock_file("model", "literal")).values
    gear = unit.gear_ratio
    low = _peak(literal_fault())
    spring = unit.preload_open / unit.torque_per_ampere * 1e3
    at_motor = controlled(unit, sinusoid(1.0 / gear), _RUN_S)
    slowly = np.abs(at_motor.velocity[at_motor.counted]).max() / unit.stribeck_velocity
    ungeared = unit.inertia / (40e-6 + 4e-6)
    crossings = int(np.count_nonzero(np.abs(normal.angle - unit.limp_home) < unit.dead_zone))
    return [
        Reading(
            "IV.4, T_st of the faulty unit",
            "0.00315 N·m, below T_c = 0.008 N·m",
            "0.0315 N·m at the motor shaft: a decimal place; just above table I's range, as a fault is",
            f"friction would rise with speed, and strategy 1 would read {low:.3f} N·m where the healthy unit gives "
            f"{_peak(unit):.3f}: no threshold finds it. A model file with T_st < T_c is refused",
        ),
        Reading(
            "IV.3 to IV.5, the shaft of T_st and T_c",
            "omega_s is given at the motor shaft, eq. (1) is written at the throttle shaft, friction at neither",
            f"T_st, T_c and omega_s at the motor shaft (times and over {gear:.0f}), B and sigma at the throttle shaft",
            f"all at the throttle: T_c is {literal.coulomb / unit.torque_per_ampere * 1e3:.0f} mA of current beside a "
            f"spring's {spring:.0f} mA, of which a tolerance of 3 % is {0.03 * spring:.0f} mA: no bench could see T_c",
        ),
        Reading(
            "table I, inertias; IV.3, T_c",
            "Kg·m/s² for inertias; T_c = 0.008 N·m outside the table's 0.0025 to 0.005",
            "kg·m², and J = J_th + G_r² J_m as eq. (1) needs it; T_c as IV.3 has it",
            f"without G_r² the throttle would be {ungeared:.0f} times as quick",
        ),
        Reading(
            "table I, K_e and K_t",
            "0.01 to 0.08 V·s/rad and 0.01 to 0.05 N·m/A, as if they were two numbers",
            "one number: in SI, K_e i is power over speed and so is K_t i",
            "K_t = 0.05 with K_e = 0.01 is a motor that gives five times the power that it takes",
        ),
        Reading(
            "IV.6, the sinusoid",
            '"a sinusoidal function with angular velocity at 30 rad/sec"',
            f"0.57 sin(30 t) rad about mid-stroke: up to {np.abs(normal.velocity[normal.counted]).max():.1f} rad/s",
            f"a peak of 30 rad/s at 30 rad/s takes 1 rad of amplitude, more than the stroke; 30 rad/s at the motor "
            f"shaft is {slowly:.2f} omega_s: T_c is never seen",
        ),
        Reading(
            "II.B, the springs' jump at limp-home",
            "two constants with a small dead zone between them",
            f"the jump is smoothed over +-{unit.dead_zone * 1e3:.0f} mrad",
            f"no other width changes figures 4 and 6: of their samples {crossings} lie in the dead zone",
        ),
        Reading(
            "II.C, aerodynamic torque",
            '"a good degree of accuracy. Therefore, [it] is not considered here", yet eq. (3) and (4) carry it',
            "zero: the bench has no airflow",
            "an airflow that is not modelled is d, and comes out as friction one to one",
        ),
        Reading(
            "IV.4, the verdict on the faulty unit",
            "the unit is a fault of friction alone",
            f"it does not come back either: the return margin is {fault.return_margin:+.3f} N·m "
            f"({unit.return_margin:+.3f} when healthy)",
            "a plate that hangs is the unit's result, no fault of the bench",
        ),
    ]


def _estimator(normal: Motion, fault: Motion) -> list[Reading]:
    unit = healthy()
    literal = numbers_of(normal, estimate(normal))
    largest = numbers_of(fault, estimate(fault)).reached
    larger = replace(paper_settings(), switching_torque=10.0 * MARGIN * unit.stiction)
    ripple = [numbers_of(normal, estimate(normal, chosen)).error_unlagged for chosen in (paper_settings(), larger)]
    ripple = [value / unit.coulomb for value in ripple]
    off = replace(unit, preload_open=1.03 * unit.preload_open, preload_close=1.03 * unit.preload_close)
    shift = estimate(normal, known=off).friction - estimate(normal).friction
    weak = np.median(np.abs(shift[np.isfinite(shift) & normal.counted]))
    fast = np.abs(normal.velocity) > FAR_ABOVE * unit.stribeck_velocity
    switching = estimate(normal, paper_settings(_NO_FILTER)).friction
    high_pass = np.mean(np.sign(normal.velocity) * (switching - estimate(normal).friction), where=fast & normal.counted)
    peaks = peak_velocities(unit)
    tail = float(np.exp(-(FAR_ABOVE**2)))
    return [
        Reading(
            "III.B, the filter",
            '"an LPF can be used to attenuate low frequency components"',
            f"it attenuates high frequencies, the switching: two poles at {CUTOFF:.0f} Hz",
            f"the opposite leaves the switching and takes friction away: {high_pass:+.4f} N·m is left beyond "
            f"{FAR_ABOVE} omega_s, where friction is {literal.true_coulomb:.3f}",
        ),
        Reading(
            "III.A, eq. (4) to (6)",
            "d stands without 1/J in (5) and beside T_f in (6); M >> 0",
            "d is a torque, over J in (5); M is above the largest |T_f + d| and no larger than needed",
            f"M = {0.9 * largest:.2f} N·m is well above zero and would not hold the sliding mode through the faulty "
            f"unit's {largest:.2f} N·m",
        ),
        Reading(
            "III.B, the size of M",
            '"there is no limitation on the value of M", and "the only limitation is switching frequency"',
            f"M = {MARGIN:.0f} T_st of the healthy unit, {MARGIN * unit.stiction:.2f} N·m: ripple grows with M",
            f"ten times that M: RMS error, lag taken off, from {ripple[0]:.1%} to {ripple[1]:.1%} of T_c",
        ),
        Reading(
            "III.B, the disturbance",
            "d has mean zero, so that first moments estimate T_st and T_c",
            "here d = 0; on a bench d is what its model has wrong, and has a sign",
            f"springs 3 % off move every estimate by {weak:.4f} N·m, {weak / unit.coulomb:.0%} of T_c, and no mean "
            "takes that away",
        ),
        Reading(
            "III.C, |omega| >> |omega_s|",
            "no factor",
            f"{FAR_ABOVE} omega_s, where the Gaussian has fallen to {tail:.0%}",
            f"3 omega_s would be {3.0 * unit.stribeck_velocity:.1f} rad/s; this throttle reaches "
            f"{min(peaks):.1f} and still stops in time: a dash, no sinusoid",
        ),
        Reading(
            "III.C, strategy 2",
            "beyond omega_s friction is bounded by T_c",
            "the viscous torque is taken off first",
            f"as printed, T_c reads {literal.coulomb_literal or np.nan:.4f} N·m for {literal.true_coulomb:.4f}, "
            f"{(literal.coulomb_literal or np.nan) / literal.true_coulomb - 1.0:+.0%}",
        ),
    ]


def _properties() -> list[Reading]:
    unit, fault = healthy(), faulty()
    bounds = bounded_bristles(unit, np.random.default_rng(1))
    end = passage(unit, 1.0, 5.0)
    gone = friction_torque(np.zeros(1), np.zeros(1), unit)[0]
    flat = fault.coulomb + (fault.stiction - fault.coulomb) * np.exp(-1.0)
    return [
        Reading(
            "property 1, the exponent",
            "(omega_s / omega_s)²",
            "(omega / omega_s)²",
            f"friction of steady sliding would be {flat:.3f} N·m at any speed of the faulty unit: no Stribeck curve, "
            "and T_st and T_c not distinguishable",
        ),
        Reading(
            "property 1 and III.C, strategy 1",
            "friction is bounded by T_st below omega_s",
            "sigma_0 |z| is; the torque adds sigma_1 dz/dt and sigma_2 omega",
            f"over random motions sigma_0 |z| stays below {bounds.bristles:.3f} T_st while |T_f| comes to "
            f"{bounds.torque:.0f} T_st where the plate is thrown round: sigma_1 omega before the bristles have turned",
        ),
        Reading(
            "property 2",
            "z can reach zero while friction passes T_st and stays at T_c",
            f"z passes zero ({end.zeros} times from T_st / sigma_0), then friction passes T_st and settles at T_c",
            f"z resting at zero is a friction of {gone:.3f} N·m: at T_c, z is "
            f"{1e3 * unit.coulomb / unit.bristle_stiffness:.1f} mrad",
        ),
        Reading(
            "eq. (2), sigma and delta",
            "delta_0 in the equation of z, sigma_0 to sigma_2 in that of T_f, delta_0 to delta_2 in the text",
            "one set of symbols: only so is g(omega) the friction of steady sliding",
            "steady friction of sigma_0 / delta_0 times g(omega): with delta_0 twice sigma_0, half of T_st and T_c",
        ),
    ]


def _peak(unit: ThrottleParameters) -> float:
    """Return what strategy 1 reads of a unit under the sinusoid, in N·m."""
    motion = controlled(unit, sinusoid(), _RUN_S)
    return numbers_of(motion, estimate(motion)).stiction
