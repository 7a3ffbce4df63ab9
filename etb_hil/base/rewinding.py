"""Mark the state of objects in virtual time, and rewind them to the mark."""

from __future__ import annotations

from typing import Any, ClassVar, TypeAlias

import numpy as np

Mark: TypeAlias = list[tuple[str, Any, Any]]  # of each attribute its name, its value, and a copy of what is in it
Marks: TypeAlias = "list[tuple[Rewindable, Mark]]"


def rewind(marks: Marks) -> None:
    """Bring objects back to their marks."""
    for one, mark in marks:
        one.rewind(mark)


class Rewindable:
    """An object whose changing state is in the attributes that `LIVES` names.

    They hold numbers, arrays, lists, sets that grow, other rewindable objects, or a dict of one of these. What `GROWS`
    names is kept, not copied: it is only written to behind the rows that another attribute counts.
    """

    LIVES: ClassVar[tuple[str, ...]] = ()
    GROWS: ClassVar[tuple[str, ...]] = ()

    @property
    def can_rewind(self) -> bool:
        """Whether these attributes are all that changes now."""
        return True

    def mark(self) -> Mark:
        """Return the present state, for `rewind`."""
        lives = [(name, value, _copy(value)) for name in self.LIVES for value in (getattr(self, name),)]
        return lives + [(name, getattr(self, name), None) for name in self.GROWS]

    def rewind(self, mark: Mark) -> None:
        """Go back to a state that `mark` returned.

        Arrays and objects stay the same ones, since others look into them.
        """
        for name, value, copy in mark:
            setattr(self, name, value)
            _restore(value, copy)


def _copy(value: Any) -> Any:  # noqa: ANN401 (whatever changes)
    """Return a copy of what is in a value, None where nothing is."""
    kind = type(value)
    if kind is int or kind is float:
        return None
    if kind is np.ndarray or kind is list or kind is set:
        return value.copy()
    if isinstance(value, Rewindable):
        return value.mark()
    return {key: (one, _copy(one)) for key, one in value.items()} if kind is dict else None


def _restore(value: Any, copy: Any) -> None:  # noqa: ANN401
    if copy is None:
        return
    if isinstance(value, Rewindable):
        value.rewind(copy)
    elif isinstance(value, set):
        value.intersection_update(copy)
    elif isinstance(value, dict):
        for key, (one, content) in copy.items():
            value[key] = one
            _restore(one, content)
    else:
        value[:] = copy
