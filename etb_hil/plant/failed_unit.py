"""The fault of a simulated unit without a finite state.

It names the effects of plug-ins.
"""

from __future__ import annotations

import math

from etb_hil.base.errors import PartFault
from etb_hil.base.plugins import parts
from etb_hil.plant.parameters import Model


def failed_unit(model: Model, angle: float) -> PartFault:
    """Return the fault of a model that gave no finite state.

    `angle` is the plate's last one before that, in rad.
    """
    where = f"with the plate near {math.degrees(angle):.3g} deg"
    used = {entry.id for entry in model.effects}
    what = f"it raised an exception, or was not finite, {where}"
    found = [part.refused(what) for part in parts("effects") if part.value.id in used]
    if found:
        return PartFault("\n".join(map(str, found)))
    return PartFault(f"the simulated unit {model.name!r} had no finite state, {where}")
