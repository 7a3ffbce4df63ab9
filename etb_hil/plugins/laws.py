"""Declaration of a position law; `LAW = ControlLaw(...)`."""

from etb_hil.controller.laws.interface import CONTROL_PERIOD as CONTROL_PERIOD
from etb_hil.controller.laws.interface import CUT_OFF as CUT_OFF
from etb_hil.controller.laws.interface import GAINS as GAINS
from etb_hil.controller.laws.interface import MEMORY as MEMORY
from etb_hil.controller.laws.interface import ControlLaw as ControlLaw
from etb_hil.plant.values import ThrottleParameters as ThrottleParameters

__all__ = ["CONTROL_PERIOD", "CUT_OFF", "GAINS", "MEMORY", "ControlLaw", "ThrottleParameters"]
