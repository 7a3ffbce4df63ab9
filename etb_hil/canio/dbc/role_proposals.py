"""Propose roles for the signals of a DBC file, each with its grounds.

They rest on names, units, value tables and ranges.

Nothing is proposed that is not about a throttle. In a throttle controller's own file every signal is; in a vehicle's
file only those are that name the throttle, and what its driver and engine do. A proposal is certain where the file
says what the role says: the role's own name, its unit and, for a mode, the numbers of the modes.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from etb_hil.base.modes import Mode
from etb_hil.base.quantity import dimension_of_unit, to_si
from etb_hil.base.roles import COMMANDED, ROLES
from etb_hil.canio.dbc.role_rules import ASKED, OF_CONTROLLERS, RULES, THROTTLE, UNITS, VEHICLE, Rule

if TYPE_CHECKING:
    from cantools.database.can import Database, Message, Signal

_SERIES = 4  # signals of one name with running numbers: samples of a burst
_MODES = {int(mode): mode.name.lower() for mode in Mode}


@dataclass(frozen=True, slots=True)
class Proposal:
    """A signal that may have a role.

    `grounds` say why, `scale` and `offset` bring it to the role's unit.

    `tick` is a sample counter's time from count to count where the DBC file does not say it.
    """

    role: str
    signal: str
    unit: str
    grounds: str
    is_likely: bool
    is_certain: bool = False
    scale: float = 1.0
    offset: float = 0.0
    wraps: bool = False
    turns: str = ""
    tick: str = ""
    points: int = 0

    @property
    def entry(self) -> str:
        """The signal as a bench file writes it."""
        keys = [f"signal: {self.signal}"]
        if self.scale != 1.0 or self.offset:
            keys.append(f"scale: {self.scale:.9g}")
        if self.offset:
            keys.append(f"offset: {self.offset:.9g}")
        if self.turns:
            keys.append(f"turns: {self.turns}")
        elif self.wraps:
            keys.append("wraps: true")
        if self.tick:
            keys.append(f"tick: {self.tick}")
        return self.signal if len(keys) == 1 else f"{{{', '.join(keys)}}}"


def proposals(database: Database) -> dict[str, list[Proposal]]:
    """Return what may have each role, the best proposal first.

    Roles for which nothing was found have no entry.
    """
    file_words = {word for message in database.messages for word in _all_words(message)}
    if not any(re.fullmatch(THROTTLE, word) for word in file_words):
        return {}
    in_vehicle = is_vehicle(database)
    found: dict[str, list[Proposal]] = {}
    for message in database.messages:
        for name, signal in _series(message):
            for rule in RULES:
                if (proposal := _judge(rule, message, signal, name, in_vehicle)) is not None:
                    found.setdefault(rule.role, []).append(proposal)
    _second_track(found)
    return {role: sorted(found[role], key=lambda p: -p.points) for role in ROLES if role in found}


def chosen(found: dict[str, list[Proposal]]) -> dict[str, list[Proposal]]:
    """Return the proposals that are sure enough to be active, by role.

    There are several where each message has its own.

    What commands the controller is active only where all of it is certain, the numbers of its modes among it.
    """
    best: dict[str, list[Proposal]] = {}
    for role, guesses in found.items():
        first, others = guesses[0], guesses[1:]
        if role == "sample_counter":
            if all(guess.is_certain for guess in guesses):
                best[role] = guesses
        elif first.is_likely and all(other.points < first.points for other in others):
            best[role] = [first]
    if not best.keys() >= {"command_mode", "command_position"}:
        best = {role: guesses for role, guesses in best.items() if role not in COMMANDED}
    return best


def is_vehicle(database: Database) -> bool:
    """Return whether a DBC file describes a vehicle's bus.

    The other units that it names tell it.
    """
    return any(re.fullmatch(VEHICLE, word) for message in database.messages for word in _all_words(message))


def a_message_each(guesses: list[Proposal]) -> list[Proposal]:
    """Return the best proposal of each message: every message counts its own samples."""
    best: dict[str, Proposal] = {}
    for guess in guesses:
        best.setdefault(guess.signal.split(".")[0], guess)
    return list(best.values())


def words_of(name: str) -> list[str]:
    """Return the words of a signal's name, in lower case.

    The name is cut at underscores, capitals and digits.
    """
    return [word.lower() for word in re.findall(r"[A-ZÄÖÜ]+(?![a-zäöüß])|[A-ZÄÖÜ]?[a-zäöüß]+|\d+", name)]


def _all_words(message: Message) -> list[str]:
    names = [message.name, *message.senders, *(signal.name for signal in message.signals)]
    return [word for name in names for word in words_of(name)]


def _series(message: Message) -> list[tuple[str, Signal]]:
    """Return the signals by the names of bench files.

    Samples of a burst, numbered one by one, are one entry.
    """
    stems: dict[str, dict[int, Signal]] = {}
    entries: dict[str, Signal] = {}
    for signal in message.signals:
        match = re.fullmatch(r"(.*?)(\d+)", signal.name)
        if match:
            stems.setdefault(match[1], {})[int(match[2])] = signal
        entries[signal.name] = signal
    for stem, numbered in stems.items():
        first, last = min(numbered), max(numbered)
        if len(numbered) >= _SERIES and last - first == len(numbered) - 1:
            for signal in numbered.values():
                del entries[signal.name]
            entries[f"{stem}{first}..{last}"] = numbered[first]
    return list(entries.items())


def _judge(rule: Rule, message: Message, signal: Signal, name: str, in_vehicle: bool) -> Proposal | None:
    words, around = words_of(signal.name), words_of(message.name)
    hits = [_first(pattern, words) for pattern in rule.words]
    # The message says what its signals are about, less surely.
    far = [_first(pattern, around) for pattern, hit in zip(rule.words, hits, strict=True) if hit is None]
    scaled = _scaled(rule, signal)
    if scaled is None or hits[0] is None or not all(far) or not _may_have(rule, signal, words):
        return None
    if in_vehicle and not rule.elsewhere and not _is_about_throttle(rule, words, around):
        return None
    unit, scale, offset = scaled
    likes = [word for word in [*words, *around] if rule.better and re.fullmatch(rule.better, word)]
    is_certain = _is_certain(rule.role, signal, words, unit)
    if rule.role in COMMANDED or rule.role in {"mode", "sample_counter"}:
        is_likely = is_certain  # a wrong one moves something, or is misread
    elif in_vehicle:
        is_likely = bool(unit and likes) and not far and rule.role != "supply_voltage"
    else:
        is_likely = is_certain or ((bool(unit) or rule.is_flag) and not far and (not rule.better or bool(likes)))
    wraps = rule.role == "motor_angle" and _is_whole_turns(signal, scale)
    return Proposal(
        rule.role,
        f"{message.name}.{name}",
        unit,
        _grounds([*filter(None, hits), *likes], [word for word in far if word], unit),
        is_likely,
        is_certain,
        scale,
        offset,
        wraps,
        _turns(message) if wraps else "",
        _guessed_tick(message) if rule.role == "sample_counter" and not is_certain else "",
        8 * is_certain + 4 * bool(unit) + 2 * (not far) + 2 * bool(likes) + len(hits),
    )


def _may_have(rule: Rule, signal: Signal, words: list[str]) -> bool:
    """Return whether nothing in a signal's length and name speaks against a role."""
    if not rule.lengths[0] <= signal.length <= rule.lengths[1] or _first(rule.never, words):
        return False
    if rule.role not in COMMANDED and _first(ASKED, words):
        return False
    return not rule.is_flag or all(re.fullmatch(rf"{OF_CONTROLLERS}|{THROTTLE}|{ASKED}|\d+", word) for word in words)


def _is_certain(role: str, signal: Signal, words: list[str], unit: str) -> bool:
    """Return whether the file itself says what the role says."""
    if role == "sample_counter":
        return _tick(signal) is not None
    has_name = "_".join(words) == role and (bool(unit) or ROLES[role].unit == "1")
    return has_name and (role not in {"mode", "command_mode"} or _names_our_modes(signal))


def _first(pattern: str, words: list[str]) -> str | None:
    return next((word for word in words if re.fullmatch(pattern, word)), None)


def _is_about_throttle(rule: Rule, words: list[str], around: list[str]) -> bool:
    """Return whether a vehicle's signal is the throttle's.

    Its name tells it, or its message where its unit speaks too.
    """
    if _first(VEHICLE, words):
        return False
    return _first(THROTTLE, words) is not None or (rule.needs_unit and _first(THROTTLE, around) is not None)


def _scaled(rule: Rule, signal: Signal) -> tuple[str, float, float] | None:
    """Return the signal's unit and what brings it to the role's.

    None where the unit speaks against the role.
    """
    wanted = dimension_of_unit(ROLES[rule.role].unit)
    unit = UNITS.get((signal.unit or "").replace("Â", "").strip().lower(), signal.unit or "")
    if not unit:
        return None if rule.needs_unit else ("", 1.0, 0.0)
    if wanted is None or dimension_of_unit(unit) != wanted:
        return None
    offset = to_si(0.0, unit, wanted)
    return unit, to_si(1.0, unit, wanted) - offset, offset


def _grounds(near: list[str], far: list[str], unit: str) -> str:
    named = f"the name contains {' and '.join(repr(word) for word in dict.fromkeys(near))}"
    about = f", the message's name {' and '.join(repr(word) for word in far)}" if far else ""
    return f"{named}{about}; {f'unit {unit}' if unit else 'no unit'}"


def _names_our_modes(signal: Signal) -> bool:
    """Return whether a mode's value table has our numbers (off 0, position 1)."""
    table = {int(number): str(name).lower() for number, name in (signal.choices or {}).items()}
    return table.keys() >= {0, 1} and all(_MODES.get(number) == name for number, name in table.items())


def _tick(signal: Signal) -> float | None:
    attribute = signal.dbc.attributes.get("SampleTickNs") if signal.dbc else None
    return None if attribute is None else float(attribute.value)


def _guessed_tick(message: Message) -> str:
    """Return the cycle time of a message.

    One sample a frame is what most counters count.
    """
    return f"{message.cycle_time or 1:g} ms"


def _is_whole_turns(signal: Signal, scale: float) -> bool:
    """Return whether the raw range is a whole number of turns.

    Such a signal is an encoder's angle that wraps around.
    """
    turns = abs(float(signal.scale)) * scale * 2**signal.length / (2.0 * math.pi)
    return round(turns) >= 1 and abs(turns - round(turns)) < 1e-6 * turns


def _turns(message: Message) -> str:
    """Return the signal that counts the turns of an encoder, or an empty text."""
    names = [s.name for s in message.signals if {"turn", "turns"} & set(words_of(s.name))]
    return f"{message.name}.{names[0]}" if len(names) == 1 else ""


def _second_track(found: dict[str, list[Proposal]]) -> None:
    """Take a second signal of the plate's angle for its second track.

    The second signal has the same message and name, and a 2 or B.
    """
    for first, second in (("throttle_angle", "throttle_angle_2"), ("throttle_position", "throttle_position_2")):
        entries = found.get(first, [])
        tracks = [p for p in entries if re.search(r"(2|_?[bB])$", p.signal)]
        names = {p.signal for p in entries}
        for track in tracks:
            stem = re.sub(r"(2|_?[bB])$", "", track.signal)
            if names & {stem, f"{stem}1", f"{stem}A", f"{stem}_A", f"{stem}_a"}:
                entries.remove(track)
                grounds = f"{track.grounds}; the second of two"
                found.setdefault(second, []).append(replace(track, role=second, grounds=grounds))
