"""The motor's constant from its voltage.

K_e = K_t in SI, and the encoder and a voltmeter tell K_e well.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from etb_hil.diagnosis.half_width import TWO_SIDED_95
from etb_hil.diagnosis.segment_bootstrap import least_squares
from etb_hil.diagnosis.ticks import Ticks
from etb_hil.diagnosis.windows import Windows, window_means
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.recording.samples import Int64

# What K_e and K_t of one motor may seem to differ by: brushes whose drop changes with the current.
_ONE_MOTOR = 0.002
_FEWEST = 20
_RESISTANCE, _BACK_EMF, _DROP = 0, 1, 5
_SURE = 4.0  # standard errors: without a drop, a fit has one in 16 000 runs


@dataclass(frozen=True, slots=True)
class VoltageBalance:
    """What the voltage says of the motor, with standard errors.

    `back_emf` (K_e G_r) is in V s/rad, `resistance` in ohm.
    """

    back_emf: float
    back_emf_error: float
    resistance: float
    resistance_error: float

    def torque_constant_shift(self, throttle: ThrottleParameters) -> tuple[float, float]:
        """Return by what share the motor's constant differs from the model's.

        The second result is the standard error of that share.
        """
        share = self.back_emf_error / throttle.back_emf
        return self.back_emf / throttle.back_emf - 1.0, math.sqrt(share * share + _ONE_MOTOR * _ONE_MOTOR)


def voltage_balance(ticks: Ticks, windows: Windows, cluster: Int64) -> VoltageBalance | None:
    """Fit the motor's voltage balance, line 1 of eq. (1) of the seed paper.

    The balance is fitted in windows (m) whose `cluster` (m) is given. An offset of the voltage and a delay between
    voltage and current are fitted along; a drop that has the current's sign, too, where there certainly is one.
    Returns None where no voltage was measured, or the run does not tell resistance from back-EMF.
    """
    voltage = window_means(ticks.voltage, windows.shape.torque, windows)
    known = np.isfinite(voltage)
    if np.count_nonzero(known) < _FEWEST:
        return None
    columns = (
        window_means(ticks.current, windows.shape.torque, windows),
        window_means(ticks.angle, windows.shape.rate, windows),
        window_means(ticks.current, windows.shape.rate, windows),
        window_means(ticks.voltage, windows.shape.rate, windows),
        np.ones(len(windows)),
        window_means(np.sign(ticks.current), windows.shape.torque, windows),
    )
    jacobian = np.stack([column[known] for column in columns], axis=1)
    for columns_used in (jacobian, np.ascontiguousarray(jacobian[:, :_DROP])):
        nothing = np.zeros((columns_used.shape[1],) * 2)
        found = least_squares(columns_used, voltage[known], cluster[known], nothing)
        if found is None:
            continue
        value, spread = found
        error = [spread.reach(one) / TWO_SIDED_95 for one in np.eye(len(value))]
        if len(value) == _DROP or abs(value[_DROP]) > _SURE * error[_DROP]:
            return VoltageBalance(
                float(value[_BACK_EMF]), error[_BACK_EMF], float(value[_RESISTANCE]), error[_RESISTANCE]
            )
    return None
