"""Propose roles for the signals of a DBC file, each with its grounds.

They rest on names, units, value tables and ranges.

Nothing is proposed that is not about a throttle. Each message is judged by what its own signals are about
(`message_subject`): a throttle controller may also receive the engine's speed. In a message of another unit only those
signals are proposed that name the throttle, and what driver and engine do. A proposal is certain where the file says
what the role says: the role's own name, its unit and, for a mode, the numbers of the modes.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from etb_hil.base.modes import Mode
from etb_hil.base.quantity import dimension_of_unit, to_si, unit_meant
from etb_hil.base.roles import COMMANDED, ROLES
from etb_hil.canio.dbc.message_subject import Subject, first_match, subjects_of, words_of
from etb_hil.canio.dbc.role_rules import ASKED, OF_CONTROLLERS, RULES, THROTTLE, VEHICLE, Rule

if TYPE_CHECKING:
    from cantools.database.can import Database, Message, Signal

_SERIES = 4  # signals of one name with running numbers: samples of a burst
_MODES = {int(mode): mode.name.lower() for mode in Mode}


@dataclass(frozen=True, slots=True)
class Proposal:
    """A signal that may have a role.

    `grounds` say why, `scale` and `offset` bring it to the role's unit.

    `tick` is a sample counter's time from count to count where the DBC file does not say it.

    `numbers` are those of a mode's value table where the role has others.
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
    numbers: str = ""
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
    subjects = subjects_of(database)
    found: dict[str, list[Proposal]] = {}
    for message in database.messages if subjects else []:
        for name, signal in _series(message):
            for rule in RULES:
                if (proposal := _judge(rule, message, signal, name, subjects[message.name])) is not None:
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


def a_message_each(guesses: list[Proposal]) -> list[Proposal]:
    """Return the best proposal of each message: every message counts its own samples."""
    best: dict[str, Proposal] = {}
    for guess in guesses:
        best.setdefault(guess.signal.split(".")[0], guess)
    return list(best.values())


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


def _judge(rule: Rule, message: Message, signal: Signal, name: str, subject: Subject) -> Proposal | None:
    words, around = words_of(signal.name), words_of(message.name)
    hits = [first_match(pattern, words) for pattern in rule.words]
    # The message says what its signals are about, less surely.
    far = [first_match(pattern, around) for pattern, hit in zip(rule.words, hits, strict=True) if hit is None]
    scaled = _scaled(rule, signal)
    # That a signal is a command may stand in the message's name alone, the quantity may not.
    quantity = hits[1] if rule.words[0] == ASKED and len(hits) > 1 else hits[0]
    if scaled is None or quantity is None or not all(far) or not _may_have(rule, signal, words, around):
        return None
    if not rule.elsewhere and not _is_about_throttle(rule, words, around, subject):
        return None
    unit, scale, offset = scaled
    likes = [word for word in [*words, *around] if rule.better and re.fullmatch(rule.better, word)]
    is_certain = _is_certain(rule.role, signal, words, unit)
    if rule.role in COMMANDED or rule.role in {"mode", "sample_counter"}:
        is_likely = is_certain  # a wrong one moves something, or is misread
    elif subject is Subject.OTHER or (rule.elsewhere and subject is not Subject.ALONE):
        is_likely = bool(unit and likes) and not far and rule.role != "supply_voltage"
    else:
        is_clear = (bool(unit) or (rule.is_flag and _is_plain(words))) and not far and (not rule.better or bool(likes))
        # Beside messages of other units, a message or signal has to name the throttle.
        is_likely = is_certain or (is_clear and (subject is Subject.ALONE or _names_throttle([*words, *around])))
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
        _other_numbers(rule.role, signal),
        8 * is_certain + 4 * bool(unit) + 2 * (not far) + 2 * bool(likes) + len(hits),
    )


def _may_have(rule: Rule, signal: Signal, words: list[str], around: list[str]) -> bool:
    """Return whether nothing in a signal's length and name speaks against a role."""
    if not rule.lengths[0] <= signal.length <= rule.lengths[1] or first_match(rule.never, words):
        return False
    if rule.role not in COMMANDED and first_match(ASKED, [*words, *(around if rule.is_flag else ())]):
        return False
    # Signals often begin as their message does: such a word names the unit.
    return not rule.is_flag or _is_plain([word for word in words if word not in around])


def _is_plain(words: list[str]) -> bool:
    """Return whether a throttle controller uses every word of a flag's name."""
    return all(re.fullmatch(rf"{OF_CONTROLLERS}|{THROTTLE}|{ASKED}|\d+", word) for word in words)


def _is_certain(role: str, signal: Signal, words: list[str], unit: str) -> bool:
    """Return whether the file itself says what the role says."""
    if role == "sample_counter":
        return _tick(signal) is not None
    has_name = "_".join(words) == role and (bool(unit) or ROLES[role].unit == "1")
    return has_name and (role not in {"mode", "command_mode"} or _names_our_modes(signal))


def _is_about_throttle(rule: Rule, words: list[str], around: list[str], subject: Subject) -> bool:
    """Return whether a signal is the throttle's.

    In a message of another unit the signal has to name the throttle, or the message where its unit speaks too.
    """
    if first_match(VEHICLE, words):
        return False
    return subject is not Subject.OTHER or _names_throttle(words) or (rule.needs_unit and _names_throttle(around))


def _names_throttle(words: list[str]) -> bool:
    return first_match(THROTTLE, words) is not None


def _scaled(rule: Rule, signal: Signal) -> tuple[str, float, float] | None:
    """Return the signal's unit and what brings it to the role's.

    None where the unit speaks against the role.
    """
    wanted = dimension_of_unit(ROLES[rule.role].unit)
    unit = unit_meant(signal.unit or "")
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
    return _table(signal).keys() >= {0, 1} and not _differs(_table(signal))


def _other_numbers(role: str, signal: Signal) -> str:
    """Return a mode's value table where it differs from the role's, or ""."""
    table = _table(signal)
    if role not in {"mode", "command_mode"} or not _differs(table):
        return ""
    return ", ".join(f"{number} {name}" for number, name in sorted(table.items()))


def _table(signal: Signal) -> dict[int, str]:
    return {int(number): str(name).lower() for number, name in (signal.choices or {}).items()}


def _differs(table: dict[int, str]) -> bool:
    return any(_MODES.get(number) != name for number, name in table.items())


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
