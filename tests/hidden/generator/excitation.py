"""What the bench commands: rich, a slow textbook sweep, ramps and steps, or voltages in open loop."""

import numpy as np

from generator.program import TICK, Program

MOVE = 2.5  # rad/s between segments


def rich(rng, unit, nominal, seconds):
    """Everything that separates causes, in random order: several speeds, multisine, dwell, reversals, stops, dashes."""
    home = nominal["limp_home"]
    program = Program(home)
    program.off(0.025 * seconds, home)
    segments = [
        (_sweeps, 0.34),
        (_multisine, 0.12),
        (_dwells, 0.15),
        (_reversals_at_home, 0.09),
        (_stops, 0.10),
        (_dashes, 0.06),
        (_staircase, 0.06),
        (_release, 0.05),
    ]
    for index in rng.permutation(len(segments)):
        segment, share = segments[index]
        segment(program, rng, unit, nominal, share * seconds)
    return program.inputs(seconds)


def slow_sweep(rng, unit, nominal, seconds):
    """One slow sweep up and down at one speed, 12 to 75 deg."""
    del unit, nominal
    low, high = np.radians([12.0, 75.0])
    program = Program(low)
    program.hold(0.5)
    speed = 2.0 * (high - low) / (seconds - 1.0) * rng.integers(1, 3)
    while program.seconds < seconds:
        program.ramp(high, speed)
        program.ramp(low, speed)
    return program.inputs(seconds)


def ramps_and_steps(rng, unit, nominal, seconds):
    """Ramps at random speeds and steps between random angles, limp-home crossed, off the stops."""
    del nominal
    program = Program(unit["limp_home"])
    low, high = unit["stop_low"] + 0.03, unit["stop_high"] - 0.03
    program.hold(0.3)
    while program.seconds < seconds:
        to = rng.uniform(low, high) if rng.random() < 0.6 else rng.choice([low, high])
        if rng.random() < 0.6:
            speed = np.exp(rng.uniform(np.log(0.3), np.log(5.0)))
            program.ramp(to, speed)
            program.hold(rng.uniform(0.05, 0.4))
        else:
            program.jump(to, rng.uniform(0.25, 0.7))
    return program.inputs(seconds)


def open_loop(rng, unit, nominal, seconds):
    """Voltages without a controller: stairs, slow sines, random switching about what holds the plate open."""
    program = Program(unit["limp_home"])
    program.off(0.5, unit["limp_home"])
    per_volt = nominal["motor_constant"] * nominal["gear_ratio"] / nominal["resistance"]
    hold = (nominal["preload_open"] + 0.7 * nominal["slope_open"]) / per_volt
    friction = nominal["stiction"] / per_volt
    while program.seconds < seconds:
        kind = rng.integers(4)
        span = rng.uniform(1.5, 4.0)
        t = np.arange(round(span / TICK)) * TICK
        if kind == 0:
            volts = (hold + 1.6 * friction) * np.floor(t / span * 24.0) / 24.0
            volts = np.concatenate([volts, volts[::-1]])
        elif kind == 1:
            volts = hold + 2.2 * friction * np.sin(2.0 * np.pi * rng.uniform(0.3, 2.0) * t)
        elif kind == 2:
            volts = -(nominal["preload_close"] / per_volt + 1.5 * friction) * np.sin(np.pi * t / span) ** 2
        else:
            switch = rng.uniform(0.02, 0.1)
            signs = rng.choice([-1.0, 1.0], size=int(span / switch) + 2)
            volts = hold + 2.5 * friction * signs[(t / switch).astype(int)]
        program.voltage(volts)
        program.off(rng.uniform(0.2, 0.4), unit["limp_home"])
    return program.inputs(seconds)


EXCITATIONS = {"rich": rich, "slow_sweep": slow_sweep, "ramps_and_steps": ramps_and_steps, "open_loop": open_loop}


def _sweeps(program, rng, unit, nominal, seconds):
    """The whole travel through limp-home at three and more speeds."""
    del nominal
    low, high = unit["stop_low"] + 0.02, unit["stop_high"] - 0.03
    length = 2.0 * (high - low)
    speeds = [length / (0.5 * seconds), length / (0.2 * seconds), rng.uniform(2.5, 4.0), rng.uniform(5.0, 8.0)]
    program.ramp(low, MOVE)
    for speed in speeds:
        for _ in range(2 if speed > 2.4 else 1):
            program.hold(0.08)
            program.ramp(high, speed)
            program.hold(0.08)
            program.ramp(low, speed)


def _multisine(program, rng, unit, nominal, seconds):
    del unit, nominal
    program.ramp(rng.uniform(0.5, 1.0), MOVE)
    program.multisine(rng, rng.uniform(0.15, 0.35), rng.uniform(15.0, 30.0), seconds - 0.4)


def _dwells(program, rng, unit, nominal, seconds):
    """Dwell, then creep until it breaks away, in both directions."""
    del unit, nominal
    program.ramp(rng.uniform(0.4, 0.6), MOVE)
    dwells = np.array([0.02, 0.06, 0.18, 0.5]) * seconds
    rng.shuffle(dwells)
    for number, dwell in enumerate(dwells):
        program.hold(dwell)
        way = 1.0 if number % 2 == 0 else -1.0
        program.ramp(program.angle + way * 0.03, 0.24 / (0.1 * seconds + 0.5))
        program.ramp(program.angle + way * 0.12 + 0.08, 1.5)


def _reversals_at_home(program, rng, unit, nominal, seconds):
    """Small reversals at limp-home, where no spring loads the teeth, and smaller ones away from it."""
    del nominal
    program.ramp(unit["limp_home"], MOVE)
    program.triangle(rng.uniform(0.02, 0.05), rng.uniform(0.8, 1.5), 0.4 * seconds)
    program.triangle(rng.uniform(0.006, 0.012), rng.uniform(1.5, 3.0), 0.2 * seconds)
    program.ramp(rng.uniform(0.4, 0.9), MOVE)
    program.triangle(rng.uniform(0.004, 0.02), rng.uniform(1.0, 2.0), 0.25 * seconds)


def _stops(program, rng, unit, nominal, seconds):
    """Ramps that press into both stops, slow and faster."""
    del nominal, seconds
    for speed in (rng.uniform(0.3, 0.5), rng.uniform(1.0, 2.0)):
        program.ramp(unit["stop_high"] - 0.05, MOVE)
        program.ramp(unit["stop_high"] + rng.uniform(0.02, 0.04), speed)
        program.ramp(unit["stop_high"] - 0.05, speed)
        program.ramp(unit["stop_low"] + 0.05, MOVE)
        program.ramp(unit["stop_low"] - rng.uniform(0.02, 0.04), speed)
        program.ramp(unit["stop_low"] + 0.05, speed)


def _dashes(program, rng, unit, nominal, seconds):
    """Full-voltage steps over most of the travel, up and down."""
    del nominal
    each = max(0.22, seconds / 8.0)
    for _ in range(max(2, int(seconds / (2.0 * each)))):
        program.jump(unit["stop_high"] - rng.uniform(0.15, 0.25), each)
        program.jump(unit["stop_low"] + rng.uniform(0.08, 0.12), each)


def _staircase(program, rng, unit, nominal, seconds):
    """Voltage steps in open loop about what holds the plate open."""
    del unit
    program.ramp(rng.uniform(0.6, 0.9), MOVE)
    program.hold(0.1)
    per_volt = nominal["motor_constant"] * nominal["gear_ratio"] / nominal["resistance"]
    hold = (nominal["preload_open"] + nominal["slope_open"] * program.angle) / per_volt
    steps = 1.5 * nominal["stiction"] / per_volt * rng.uniform(-1.0, 1.0, 24)
    each = max(1, round((seconds - 0.4) / 24 / TICK))
    program.voltage(hold + np.repeat(steps, each))
    program.hold(0.15)


def _release(program, rng, unit, nominal, seconds):
    """Let go with the bridge off: the springs drive the plate home, and there the current is zero."""
    del nominal
    for start in (rng.uniform(0.7, 1.2), unit["stop_low"] + 0.02):
        program.ramp(start, MOVE)
        program.hold(0.1)
        program.off(max(0.4, 0.25 * seconds), unit["limp_home"])
