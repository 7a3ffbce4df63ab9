"""Which signals of a DBC file may have which role, judged by their names and units; guesses, with their grounds.

A name is cut into words (`MO3_DKW`, `throttlePos2`, `Drosselklappe`), English or German; a role is proposed where its
words are there and the unit does not speak against it. Nothing is certain: the text says what a guess rests on.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from etb_hil.base.quantity import dimension_of_unit, to_si
from etb_hil.base.roles import COMMANDED, ROLES

if TYPE_CHECKING:
    from cantools.database.can import Database, Message, Signal

# What DBC files write for units, beside the spellings that every file of ours takes.
_UNITS = {
    "unit_percent": "%", "unit_degrecelsi": "degC", "unit_volt": "V", "unit_amper": "A", "unit_minutinver": "rpm",
    "unit_degreeofarc": "deg", "u/min": "rpm", "umin": "rpm", "upm": "rpm", "1/min": "rpm", "min-1": "rpm", "c": "degC",
    "grad": "deg", "°": "deg", "°c": "degC", "degree": "deg", "degrees": "deg", "volt": "V", "volts": "V", "amps": "A",
    "amp": "A", "percent": "%", "celsius": "degC", "deg c": "degC", "degk": "K",
}  # fmt: skip

_THROTTLE = r"throttle|thr|tps|etb|etc|drosselklappe\w*|drosselklapp\w*|dk|dkw|plate|valve|klappe"
_MOTOR = r"motor|mot|bridge|armature|actuator|h_?bridge"
_ANGLE = r"angle|ang|pos|position|winkel|lage|stellung|encoder|\w*winkel"
_ASKED = r"cmd|command|commanded|set|setpoint|soll\w*|target|tgt|desired|des|demand|request|req|wunsch\w*|ref"
# A word of these makes a signal something about a quantity, not the quantity.
_ABOUT = (
    r"status|stat|sta|state|qbit|bit|valid|error|err|fehler\w*|fault|warn\w*|max|min|limit\w*|grenze|gradient|delta|sign|"
    r"vz|vorzeichen|crc|checksum|checksumme|counter|cnt|bz|offset|offs|code|type|typ|frei|reserved|spare|einheit|schutz|"
    r"uebertemp|unterspannung|flag|mask|anf|begrenzun\w*|sollwertbegrenzun\w*|gross|zu|klein|norm\w*|maxnorm"
)


@dataclass(frozen=True, slots=True)
class _Rule:
    """A role's words: every pattern must be there; `better` ones make the guess stronger."""

    role: str
    words: tuple[str, ...]
    better: str = ""
    never: str = _ABOUT
    lengths: tuple[int, int] = (6, 64)  # bits: an analogue value has some


_FLAG = (1, 16)
_SERIES = 4  # signals of one name with running numbers: samples of a burst
_RULES = (
    _Rule("motor_current", (r"current|curr|strom|\w*strom|amps?|i", rf"{_MOTOR}|{_THROTTLE}")),
    _Rule("motor_voltage", (r"voltage|volt|spannung|\w*spannung|u", rf"{_MOTOR}")),
    _Rule("motor_duty", (r"duty|pwm|tastverh\w*|dutycycle",)),
    _Rule("motor_angle", (_ANGLE, r"motor|mot|rotor|encoder|shaft|armature"), never=f"{_ABOUT}|{_THROTTLE}"),
    _Rule("throttle_angle", (_THROTTLE,), better=_ANGLE),
    _Rule("throttle_opening", (_THROTTLE,), better=rf"{_ANGLE}|opening|abs"),
    _Rule("throttle_position", (_THROTTLE,), better=r"raw|volt\w*|sensor|track|adc"),
    _Rule(
        "pedal_position", (r"pedal\w*|fahrpedal\w*|accel|app|pps|accelerator",), better=r"pos|position|\w*wert|wert|abs"
    ),
    _Rule(
        "temperature", (r"temp|temperature|temperatur|\w*temperatur",), better=rf"{_THROTTLE}|housing|gehaeuse|board"
    ),
    _Rule(
        "supply_voltage", (r"supply|batt|battery|ubat|vbat|kl30|bordnetz\w*|batteriespannung|vsupply|versorgung\w*",)
    ),
    _Rule(
        "engine_speed",
        (r"rpm|drehzahl|motordrehzahl|kurbelwellendrehzahl|speed|n", r"engine|eng|motor\w*|kurbel\w*|mo\d*"),
    ),
    _Rule("sample_counter", (r"sample", r"count|counter|cnt|number|index"), never=r"alive", lengths=(4, 32)),
    _Rule("mode", (r"mode|betriebsart|modus",), better=rf"{_THROTTLE}|controller", never=r"sleep", lengths=_FLAG),
    _Rule(
        "enable", (r"enable|enabled|bridge|driver", r"on|enable|enabled|active|ein"), never=r"error|err", lengths=(1, 2)
    ),
    _Rule("faults", (r"faults?|errors?|fehler|dtc|diag",), better=_THROTTLE, never=r"crc|counter", lengths=(2, 32)),
    _Rule("command_position", (_ASKED, rf"{_ANGLE}|{_THROTTLE}"), better=_THROTTLE),
    _Rule("command_velocity", (_ASKED, r"velocity|vel|omega|rate"), better=_THROTTLE),
    _Rule("command_voltage", (_ASKED, r"voltage|volt|spannung")),
    _Rule("command_duty", (_ASKED, r"duty|pwm")),
    _Rule("command_mode", (_ASKED, r"mode|betriebsart"), never=r"crc", lengths=_FLAG),
    _Rule("request_signals", (r"request|req", r"signals?"), never=r"crc", lengths=_FLAG),
    _Rule("request_rate", (r"request|req", r"rate|frequency"), never=r"crc"),
    _Rule("request_burst", (r"request|req", r"burst"), never=r"crc", lengths=(1, 2)),
    _Rule("request_duration", (r"request|req", r"duration"), never=r"crc"),
    _Rule("controller_time", (r"controller|ecu", r"time|clock|uptime"), lengths=(16, 64)),
    _Rule("command_enable", (_ASKED, r"enable|on|ein"), never=r"crc", lengths=(1, 2)),
)


@dataclass(frozen=True, slots=True)
class Proposal:
    """A signal that may have a role; `grounds` say why, `scale` and `offset` bring it to the role's unit."""

    role: str
    signal: str
    unit: str
    grounds: str
    is_likely: bool
    scale: float = 1.0
    offset: float = 0.0
    points: int = 0

    @property
    def entry(self) -> str:
        """The signal as a bench file writes it."""
        if self.scale == 1.0 and not self.offset:
            return self.signal
        shift = f", offset: {self.offset:.9g}" if self.offset else ""
        return f"{{signal: {self.signal}, scale: {self.scale:.9g}{shift}}}"


def proposals(database: Database) -> dict[str, list[Proposal]]:
    """Return what may have each role, the best guess first; roles for which nothing was found have no entry."""
    found: dict[str, list[Proposal]] = {}
    for message in database.messages:
        for name, signal in _series(message):
            for rule in _RULES:
                if (proposal := _judge(rule, message, signal, name)) is not None:
                    found.setdefault(rule.role, []).append(proposal)
    _second_track(found)
    return {role: sorted(found[role], key=lambda p: -p.points) for role in ROLES if role in found}


def _series(message: Message) -> list[tuple[str, Signal]]:
    """Return the signals by the names of bench files: samples of a burst, numbered one by one, are one entry."""
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


def words_of(name: str) -> list[str]:
    """Return the words of a signal's name, in lower case: cut at underscores, capitals and digits."""
    return [word.lower() for word in re.findall(r"[A-ZÄÖÜ]+(?![a-zäöüß])|[A-ZÄÖÜ]?[a-zäöüß]+|\d+", name)]


def _judge(rule: _Rule, message: Message, signal: Signal, name: str) -> Proposal | None:
    words = words_of(signal.name)
    hits = [next((word for word in words if re.fullmatch(pattern, word)), None) for pattern in rule.words]
    if hits[0] is None or not rule.lengths[0] <= signal.length <= rule.lengths[1]:
        return None
    around = words_of(message.name)  # what a message is about says what its signals are about, less surely
    far = [next((w for w in around if re.fullmatch(pattern, w)), None) for pattern in rule.words[1:]]
    if any(near is None and distant is None for near, distant in zip(hits[1:], far, strict=True)):
        return None
    is_asked = any(re.fullmatch(_ASKED, word) for word in words)
    if any(re.fullmatch(rule.never, word) for word in words) or (is_asked and rule.role not in COMMANDED):
        return None
    wanted = dimension_of_unit(ROLES[rule.role].unit)
    unit = _UNITS.get((signal.unit or "").replace("Â", "").strip().lower(), signal.unit or "")
    dimension = dimension_of_unit(unit) if unit else None
    if unit and dimension != wanted:
        return None
    if not unit and rule.role.startswith("throttle"):
        return None  # a bare number may be degrees, volts or a share: no guess
    likes = [word for word in [*words, *around] if rule.better and re.fullmatch(rule.better, word)]
    found = list(dict.fromkeys([*filter(None, hits), *likes]))
    named = f"its name holds {' and '.join(repr(word) for word in found)}"
    distant = [word for near, word in zip(hits[1:], far, strict=True) if near is None and word]
    about = f", its message's {' and '.join(repr(word) for word in distant)}" if distant else ""
    stated = f", its unit is {unit}" if unit else ", it states no unit"
    scale = offset = 0.0
    if unit and wanted is not None:
        offset = to_si(0.0, unit, wanted)
        scale = to_si(1.0, unit, wanted) - offset
    is_flag = wanted == "ratio" and rule.lengths[0] < 6
    points = 4 * bool(unit) + 2 * (not distant) + 2 * bool(likes) + len(hits)
    is_likely = (bool(unit) or is_flag) and not distant and (not rule.better or bool(likes))
    return Proposal(
        rule.role,
        f"{message.name}.{name}",
        unit,
        named + about + stated,
        is_likely,
        scale or 1.0,
        offset,
        points,
    )


def _second_track(found: dict[str, list[Proposal]]) -> None:
    """Take a second signal of the plate's angle, of the same message, name and a 2 or B, for its second track."""
    for first, second in (("throttle_angle", "throttle_angle_2"), ("throttle_position", "throttle_position_2")):
        entries = found.get(first, [])
        tracks = [p for p in entries if re.search(r"(2|_?[bB])$", p.signal)]
        names = {p.signal for p in entries}
        for track in tracks:
            stem = re.sub(r"(2|_?[bB])$", "", track.signal)
            if names & {stem, f"{stem}1", f"{stem}A", f"{stem}_A", f"{stem}_a"}:
                entries.remove(track)
                found.setdefault(second, []).append(
                    Proposal(
                        second, track.signal, track.unit, f"{track.grounds}, and it is the second of two",
                        track.is_likely, track.scale, track.offset, track.points,
                    )
                )  # fmt: skip


def chosen(found: dict[str, list[Proposal]]) -> dict[str, Proposal]:
    """Return the guesses that are good enough to start from: likely, and better than any other signal's."""
    best: dict[str, Proposal] = {}
    for role, guesses in found.items():
        first, others = guesses[0], guesses[1:]
        if role not in COMMANDED and first.is_likely and all(other.points < first.points for other in others):
            best[role] = first
    return best
