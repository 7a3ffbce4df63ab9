"""Declaration of a kind of phase: a subclass of `PhaseModel`.

A plug-in writes `PHASE = MyPhase`.
"""

from etb_hil.base.modes import Mode as Mode
from etb_hil.base.quantity import Angle as Angle
from etb_hil.base.quantity import AngularVelocity as AngularVelocity
from etb_hil.base.quantity import Duration as Duration
from etb_hil.base.quantity import Frequency as Frequency
from etb_hil.base.quantity import Ratio as Ratio
from etb_hil.base.quantity import Voltage as Voltage
from etb_hil.diagnosis.phase_use import Use as Use
from etb_hil.plant.values import ThrottleParameters as ThrottleParameters
from etb_hil.scenario.phase import Between as Between
from etb_hil.scenario.phase import PhaseModel as PhaseModel
from etb_hil.scenario.phase import PositiveAngle as PositiveAngle
from etb_hil.scenario.phase import PositiveFrequency as PositiveFrequency
from etb_hil.scenario.phase import PositiveSpeed as PositiveSpeed
from etb_hil.scenario.phase import PositiveTime as PositiveTime
from etb_hil.scenario.phase import Repeat as Repeat
from etb_hil.scenario.trajectory import Chain as Chain
from etb_hil.scenario.trajectory import Held as Held
from etb_hil.scenario.trajectory import Released as Released
from etb_hil.scenario.trajectory import SetPoint as SetPoint
from etb_hil.scenario.trajectory import Steps as Steps
from etb_hil.scenario.trajectory import Trajectory as Trajectory
from etb_hil.scenario.trajectory import dash as dash
from etb_hil.scenario.trajectory import move as move

__all__ = [
    "Angle",
    "AngularVelocity",
    "Between",
    "Chain",
    "Duration",
    "Frequency",
    "Held",
    "Mode",
    "PhaseModel",
    "PositiveAngle",
    "PositiveFrequency",
    "PositiveSpeed",
    "PositiveTime",
    "Ratio",
    "Released",
    "Repeat",
    "SetPoint",
    "Steps",
    "ThrottleParameters",
    "Trajectory",
    "Use",
    "Voltage",
    "dash",
    "move",
]
