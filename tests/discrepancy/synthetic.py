"""Short records of our own plant under a tracking voltage: everything that the effects need, in some seconds."""

import warnings

import numpy as np

from etb_hil.base.stock import find
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.rerun import rerun
from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.plant.parameters import load_model

RATE = 2000.0

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    MODEL = load_model(find("model", "default"))


def swept(seconds=12.0):
    """Angle (n) in rad: both stops, several speeds, dwells with break-away, small reversals at limp-home."""
    high, home = MODEL.values.stop_high, MODEL.values.limp_home
    places = [
        (0.0, home), (0.3, home), (1.0, high + 0.002), (1.2, high + 0.002), (2.2, -0.002), (2.4, -0.002), (2.7, 1.3),
        (3.0, 0.2), (4.8, 1.2), (6.0, 0.5), (6.6, 0.5), (6.9, 0.7), (7.3, 0.7), (7.6, 0.4), (8.2, home),
    ]  # fmt: skip
    t = np.arange(round(seconds * RATE)) / RATE
    angle = np.interp(t, *zip(*places, strict=True))
    late = t > 8.2
    angle[late] += 0.02 * np.sin(2.0 * np.pi * 1.3 * (t[late] - 8.2)) * (t[late] < 10.0)
    angle[late] += 0.3 * np.sin(2.0 * np.pi * 2.1 * (t[late] - 10.0)) * (t[late] > 10.0)
    kernel = np.hanning(81)
    return np.convolve(np.pad(angle, 40, mode="edge"), kernel / kernel.sum(), "valid")


def textbook(seconds=12.0):
    """Angle (n) in rad of a slow sweep at one speed, 12 to 75 deg, up and down."""
    t = np.arange(round(seconds * RATE)) / RATE
    low, high = np.radians([12.0, 75.0])
    return np.interp(t * 12.0 / seconds, [0.0, 0.5, 6.0, 11.5, 12.0], [low, low, high, low, low])


def measurement(p, seed, angle=None, degrees=(20.0, 70.0)):
    """What the sensors of the model make of a unit with the extended parameters `p` on the sweep, or on another.

    `degrees`: of the housing at the beginning and at the end.
    """
    angle = swept() if angle is None else angle
    count = len(angle)
    warm = np.linspace(*degrees, count)
    nothing = np.zeros(count)
    asked = Measurement(
        origin="synthetic",
        rate=RATE,
        start_s=0.0,
        voltage=nothing,
        angle=angle,
        angle_noise=2.0 * np.pi / MODEL.sensors.motor_counts_per_turn / MODEL.values.gear_ratio / np.sqrt(12.0),
        current=np.ones(count),  # the bridge is on throughout
        plate=angle,
        temperature=warm,
        has_temperature=True,
        is_good=np.ones(count, bool),
        sensors=MODEL.sensors,
    )
    return rerun(Balances(asked, MODEL), p, seed)
