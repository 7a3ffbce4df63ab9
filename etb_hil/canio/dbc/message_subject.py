"""Which unit each message of a DBC file is about.

The unit is the throttle, with its controller, or another one of a vehicle.
"""

from __future__ import annotations

import re
from enum import Enum, auto
from typing import TYPE_CHECKING

from etb_hil.canio.dbc.role_rules import THROTTLE, VEHICLE

if TYPE_CHECKING:
    from cantools.database.can import Database, Message


class Subject(Enum):
    """What a message is about."""

    ALONE = auto()  # the throttle: the file names no other unit
    THROTTLE = auto()  # the throttle, or its controller; other messages of the file are about other units
    OTHER = auto()  # another unit


def subjects_of(database: Database) -> dict[str, Subject]:
    """Return what each message is about, by its name.

    The result is empty where no message names a throttle.
    """
    messages = database.messages
    if not any(_count(THROTTLE, message, with_senders=True) for message in messages):
        return {}
    if not any(_count(VEHICLE, message, with_senders=True) for message in messages):
        return {message.name: Subject.ALONE for message in messages}
    about_throttle = [message for message in messages if _is_about_throttle(message)]
    about_others = [message for message in messages if _count(VEHICLE, message) and message not in about_throttle]
    # A node is the throttle's controller, or its tester, where it sends nothing about another unit.
    nodes = _senders(about_throttle) - _senders(about_others)
    own = {message.name for message in about_throttle}
    own |= {message.name for message in messages if message not in about_others and _is_of(message, nodes)}
    return {message.name: Subject.THROTTLE if message.name in own else Subject.OTHER for message in messages}


def names_other_units(database: Database) -> bool:
    """Return whether a message of a DBC file is about another unit than the throttle."""
    return Subject.OTHER in subjects_of(database).values()


def words_of(name: str) -> list[str]:
    """Return the words of a signal's name, in lower case.

    The name is cut at underscores, capitals and digits.
    """
    return [word.lower() for word in re.findall(r"[A-ZÄÖÜ]+(?![a-zäöüß])|[A-ZÄÖÜ]?[a-zäöüß]+|\d+", name)]


def first_match(pattern: str, words: list[str]) -> str | None:
    """Return the first word that a pattern matches as a whole, or None."""
    return next((word for word in words if re.fullmatch(pattern, word)), None)


def _is_about_throttle(message: Message) -> bool:
    """Tell whether name or signals name the throttle, and less often another unit."""
    if first_match(VEHICLE, words_of(message.name)):
        return False
    return _count(THROTTLE, message) > _count(VEHICLE, message)


def _is_of(message: Message, nodes: set[str]) -> bool:
    """Tell whether some nodes send a message or are its only receivers."""
    receivers = {name for signal in message.signals for name in signal.receivers}
    senders = set(message.senders)
    if any(first_match(VEHICLE, words_of(name)) for name in senders):
        return False
    return bool(senders & nodes) or bool(receivers and receivers <= nodes)


def _senders(messages: list[Message]) -> set[str]:
    return {name for message in messages for name in message.senders}


def _count(pattern: str, message: Message, *, with_senders: bool = False) -> int:
    """Return how many names of a message and its signals have a word of a pattern."""
    names = [message.name, *(signal.name for signal in message.signals)]
    if with_senders:
        names += message.senders
    return sum(first_match(pattern, words_of(name)) is not None for name in names)
