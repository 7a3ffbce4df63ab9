"""Where the parameters of each effect stand in the extended vector.

They are behind the base model's, in the order in which effects are taken in.
"""

from __future__ import annotations

import numpy as np

from etb_hil.plant.physics import PARAMETERS, Vector

PLATE_INERTIA = PARAMETERS  # of the plate alone, for what lies between motor and plate
ELASTIC = PLATE_INERTIA + 1  # share of friction up to which bristles are elastic, 0: LuGre friction
EFFECTS = ELASTIC + 1
ROOM = 256  # numbers for all effects together; compiled code knows this length, so that it never changes
EXTENDED = EFFECTS + ROOM
SLOW = 16  # slow states of all effects together, likewise

_rows: dict[str, range] = {}
_states: dict[str, range] = {}


def row(effect: str) -> int:
    """Return the index of an effect's first parameter in the extended vector."""
    return _rows[effect].start


def first_state(effect: str) -> int:
    """Return the index of an effect's first state among the slow states."""
    return _states[effect].start


def is_full(width: int, states: int) -> bool:
    """Tell whether there is no room for so many more parameters and states.

    They are those of another effect.
    """
    return _free(_rows, width, EFFECTS) + width > EXTENDED or _free(_states, states, 0) + states > SLOW


def give_room(effect: str, width: int, states: int) -> None:
    """Set the parameters and states of an effect behind those of the others.

    ValueError where there is no room.
    """
    if is_full(width, states):
        raise ValueError(f"no room for {effect}: {ROOM} parameters and {SLOW} states of effects are the most")
    row, state = _free(_rows, width, EFFECTS), _free(_states, states, 0)
    _rows[effect], _states[effect] = range(row, row + width), range(state, state + states)


def take_room(effect: str) -> None:
    """Free the room of an effect."""
    del _rows[effect], _states[effect]


def extended(base: Vector) -> Vector:
    """Return base parameters (24) with no effect behind them (float64, `EXTENDED`)."""
    return np.concatenate([base, np.zeros(EXTENDED - PARAMETERS)])


def _free(taken: dict[str, range], width: int, first: int) -> int:
    """Return the first index from which so many numbers are free."""
    index = first
    for one in sorted(taken.values(), key=lambda one: one.start):
        if index + width <= one.start:
            break
        index = max(index, one.stop)
    return index
