"""A run as the report sees it, made by hand: a plate that is swept, dashed and let go."""

import numpy as np

from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.report.series import ReportSeries
from etb_hil.results.measurement import Measurement, Measurements
from etb_hil.results.run_result import (
    AnswerTime,
    Attempt,
    Bench,
    Bus,
    Clock,
    Exceedance,
    FrameAge,
    InputFile,
    Lateness,
    MessageStatistics,
    Phase,
    Prompt,
    RunResult,
    Unit,
)

T_C, T_ST, OMEGA_S, VISCOUS = 0.144, 0.171, 7.8, 0.001
DURATION_S = 24.0
PHASES = (
    ("home", 0, 3),
    ("bridge off", 3, 5),
    ("ramp opening", 5, 11),
    ("ramp closing", 11, 17),
    ("dash", 17, 21),
    ("teardown", 21, 24),
)

HASH = "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08"
FILES = (
    ("model", "paper.yaml"),
    ("limits", "paper.yaml"),
    ("bench", "virtual.yaml"),
    ("scenario", "friction_check.yaml"),
    ("dbc", "etb.dbc"),
)


def stribeck(velocity, stiction=T_ST):
    level = T_C + (stiction - T_C) * np.exp(-((velocity / OMEGA_S) ** 2))
    return np.sign(velocity) * level + VISCOUS * velocity


def series(stiction=T_ST, rate_hz=1000):
    rng = np.random.default_rng(7)
    time = np.arange(int(DURATION_S * rate_hz)) / rate_hz
    ramp = np.interp(
        time,
        [0, 1, 2, 3, 5, 11, 17, 18, 18.08, 19, 19.08, 21, 24],
        [0.14, 1.48, 0, 0.14, 0.14, 1.4, 0.05, 0.05, 1.3, 1.3, 0.1, 0.14, 0.14],
    )
    velocity = np.gradient(ramp, time)
    moving = np.abs(velocity) > 1e-6
    friction = np.where(moving, stribeck(velocity, stiction), 0.05) + rng.normal(0, 0.004, len(time))
    current = 0.9 * np.tanh(8 * (ramp - 0.14)) + friction / 0.36 + rng.normal(0, 0.02, len(time))
    speeds = np.concatenate([-np.geomspace(18, 0.05, 300), np.geomspace(0.05, 18, 300)])
    curve = np.concatenate([np.linspace(-18, -0.01, 150), np.linspace(0.01, 18, 150)])
    angles = np.linspace(0.02, 1.46, 90)
    place = rng.uniform(0.02, 1.46, len(speeds))
    wave = 0.006 * np.sin(9 * angles)
    return ReportSeries(
        time=time,
        angle=ramp,
        velocity=velocity,
        current=current,
        friction=friction,
        point_velocity=speeds,
        point_friction=stribeck(speeds, stiction) + rng.normal(0, 0.006, len(speeds)),
        point_angle=place,
        point_temperature=np.where(place > 0.7, 23.4, 31.0),
        point_excess=np.where(np.abs(place - 1.0) < 0.1, 0.4, 0.0) + rng.normal(0, 0.01, len(speeds)),
        curve_velocity=curve,
        curve_friction=stribeck(curve, stiction),
        curve_low=stribeck(curve, stiction) - 0.006,
        curve_high=stribeck(curve, stiction) + 0.006,
        opening_angle=angles,
        opening_friction=stribeck(0.2, stiction) + wave,
        closing_angle=angles,
        closing_friction=-stribeck(0.2, stiction) + wave,
    )


def results(stiction=T_ST, **changes):
    failed = stiction > 0.25
    unit = Unit(
        UnitVerdict.FAIL if failed else UnitVerdict.PASS,
        "T_st_beyond_limit" if failed else "within_limits",
        serial="ETB-0042",
        part_number="A 113",
        revision="C",
    )
    fields = {
        "run_id": "20261120T070000Z-friction_check-ETB-0042",
        "unit": unit,
        "bench": Bench(
            BenchOutcome.OK,
            safe_state=True,
            name="virtual classic",
            lateness=Lateness(0.05, 1.25),
            frame_age=FrameAge(0.6, 2.0),
            answer_time=AnswerTime(5.2, 10.4),
        ),
        "started": "2026-11-20T07:00:00Z",
        "duration_s": DURATION_S,
        "timestamp_grade": "sample counter",
        "clock": Clock(-1.2, 36.0, 121.0),
        "measurements": Measurements(numbers(stiction)),
        "exceedances": exceedances(stiction) if failed else (),
        "phases": tuple(
            Phase(name.replace(" ", "_"), name, start, end, "done", 9.25 if name == "ramp opening" else None)
            for name, start, end in PHASES
        ),
        "prompts": (Prompt("clamped", "Is the unit clamped?", "yes", "operator", 0.5),),
        "attempts": (Attempt(1, BenchOutcome.OK, UnitVerdict.INCONCLUSIVE, "too_little_motion", "attempts/1"),),
        "bus": Bus(
            "etb_virtual, classic, 500 kbit/s",
            load=0.614,
            load_peak=0.66,
            error_frames=0,
            state="error-active",
            receive_errors=3,
            messages=(
                MessageStatistics("Measurement", 24000, 0),
                MessageStatistics("Position", 24000, 0),
                MessageStatistics("Status", 2400, 0),
            ),
        ),
        "versions": {"etb_hil": "0.1.0", "python": "3.11.9", "numpy": "2.4.6", "numba": "0.63.0"},
        "inputs": tuple(InputFile(kind, name, HASH) for kind, name in FILES),
    }
    return RunResult(**{**fields, **changes})


def numbers(stiction):
    margin = 0.35 - stiction
    above, short = stiction > 0.25, margin < 0.05
    return (
        Measurement(
            "T_st",
            "break-away friction",
            stiction,
            "N·m",
            stiction - 0.004,
            stiction + 0.004,
            limit_high=0.25,
            verdict=UnitVerdict.FAIL if above else UnitVerdict.PASS,
        ),
        Measurement(
            "T_c", "sliding friction", T_C, "N·m", T_C - 0.002, T_C + 0.002, limit_high=0.18, verdict=UnitVerdict.PASS
        ),
        Measurement(
            "return_margin",
            "return margin",
            margin,
            "N·m",
            margin - 0.01,
            margin + 0.01,
            limit_low=0.05,
            verdict=UnitVerdict.FAIL if short else UnitVerdict.PASS,
        ),
        Measurement("omega_s", "Stribeck velocity", OMEGA_S, "rad/s", 7.1, 8.4),
        Measurement("viscous", "viscous friction", VISCOUS, "N·m·s/rad", 0.0008, 0.0012),
        Measurement("temperature", "housing temperature", 23.4, "degC"),
    )


UNEVEN = (
    Measurement("friction_least", "least slow friction along the way", 0.15, "N·m"),
    Measurement("friction_least_at", "place of the least slow friction along the way", 0.2, "rad"),
    Measurement("friction_most", "most slow friction along the way", 0.22, "N·m"),
    Measurement("friction_most_at", "place of the most slow friction along the way", 0.8, "rad"),
)


def exceedances(stiction):
    return (
        Exceedance("T_st", 5.0, 5.4, stiction, 0.25, 0.2, 0.21, 23.4, "ramp opening"),
        Exceedance("T_st", 11.0, 11.3, stiction * 0.97, 0.25, 1.39, -0.2, 23.4, "ramp closing"),
    )
