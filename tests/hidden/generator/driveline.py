"""Between motor and plate: play of the teeth and twist of the shaft."""

import math

from generator import layout as at
from generator.compiled import compiled

TOOTH_STIFFNESS = 2e4  # N·m/rad: teeth in contact are all but rigid
TOOTH_DAMPING = 0.5  # N·m·s/rad


@compiled()
def is_two_mass(e):
    """Tell whether an effect parts the plate from the motor."""
    return e[at.BACKLASH, at.STRENGTH] > 0.0 or e[at.COMPLIANCE, at.STRENGTH] > 0.0


@compiled()
def coupling_torque(twist, twist_rate, e):
    """Torque from motor side to plate, N·m, for a twist in rad at the throttle shaft."""
    if e[at.BACKLASH, at.STRENGTH] > 0.0:
        row = e[at.BACKLASH]
        depth = abs(twist) - 0.5 * row[at.STRENGTH]
        if depth <= 0.0:
            return row[at.A] * twist_rate
        force = TOOTH_STIFFNESS * depth
        if row[at.FORM] == 1.0:
            force *= math.sqrt(depth / 1e-4)
        # Contact pushes and never pulls.
        torque = max(0.0, force + TOOTH_DAMPING * math.copysign(1.0, twist) * twist_rate)
        return math.copysign(torque, twist)
    row = e[at.COMPLIANCE]
    stiffness = 1.0 / row[at.STRENGTH]
    if row[at.FORM] == 1.0:
        stiffness *= 1.0 + (twist / 0.01) ** 2
    elif row[at.FORM] == 2.0:
        stiffness *= 0.7 + 0.3 / (1.0 + (twist / 0.004) ** 2)
    return stiffness * twist + row[at.A] * twist_rate
