"""Declaration of an observer; `OBSERVER = ObserverKind(...)`."""

from etb_hil.observer.estimate import FrictionEstimate as FrictionEstimate
from etb_hil.observer.estimate import Observer as Observer
from etb_hil.observer.estimate import SensorNoise as SensorNoise
from etb_hil.observer.registry import ObserverKind as ObserverKind
from etb_hil.plant.parameters import Model as Model
from etb_hil.plant.physics import spring_torque as spring_torque
from etb_hil.plant.values import ThrottleParameters as ThrottleParameters

__all__ = [
    "FrictionEstimate",
    "Model",
    "Observer",
    "ObserverKind",
    "SensorNoise",
    "ThrottleParameters",
    "spring_torque",
]
