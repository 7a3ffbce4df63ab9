"""Declaration of an effect; `EFFECT = Effect(...)`."""

from etb_hil.plant.component import Component as Component
from etb_hil.plant.effects.effect import Balance as Balance
from etb_hil.plant.effects.effect import Effect as Effect
from etb_hil.plant.effects.effect import EffectParameter as EffectParameter
from etb_hil.plant.effects.effect import Law as Law
from etb_hil.plant.effects.effect import Need as Need
from etb_hil.plant.effects.effect import Parity as Parity
from etb_hil.plant.effects.effect import State as State
from etb_hil.plant.effects.effect import finer as finer
from etb_hil.plant.effects.effect import shape as shape
from etb_hil.plant.effects.effect import strength as strength
from etb_hil.plant.effects.port import Port as Port

__all__ = [
    "Balance",
    "Component",
    "Effect",
    "EffectParameter",
    "Law",
    "Need",
    "Parity",
    "Port",
    "State",
    "finer",
    "shape",
    "strength",
]
