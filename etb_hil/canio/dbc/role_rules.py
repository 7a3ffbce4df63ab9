"""Words in signal names that indicate a role, in English and German.

`role_proposals` applies them.
"""

from __future__ import annotations

from dataclasses import dataclass

THROTTLE = r"throttle\w*|thrott|throt|thrtl|thr|plate|tps|etb|etc|drosselklapp\w*|dk|dkw|dks"
# A message with more of these than of the throttle's is another unit's: so are its drives, modes and faults.
VEHICLE = (
    r"wheel\w*|steer\w*|lenk\w*|brake\w*|brems\w*|door\w*|seat\w*|cruise\w*|cruse|esp|airbag\w*|gearbox|getriebe|"
    r"transmission|vehicle\w*|fahrzeug\w*|hvac|aircon\w*|conditioning|climate|klima\w*|clutch|kuppl\w*|lamps?|lights?|park\w*|radar|yaw|"
    r"lkas|egr|turbo|catalyst|kat|ekat|engine\w*|eng|injector\w*|ignition|lambda|coolant|fuel|oil|gears?|compressor|heater|"
    r"heiz\w*|fan|pump"
)
# A flag states no unit: every word of its name must be one that a throttle controller uses.
OF_CONTROLLERS = (
    r"motor|mot|bridge|driver|drive|output|power|stage|controller|ctrl|control|ecu|status|state|act|actual|is|bits?|"
    r"word|number|the|h|on|off|active|ein|enabled?|mode|betriebsart|modus|faults?|errors?|fehler|dtc|flags?"
)
ANGLE = r"angle|ang|pos|position|winkel|lage|stellung|encoder|\w*winkel"
ASKED = (
    r"cmd|command|commanded|set|setpoint|setp|stpt|sp|soll\w*|target|tar|tgt|desired|des|demand|requested|request|req|rq|wunsch\w*|"
    r"ref"
)
_MOTOR_VOLTAGE, _MOTOR_CURRENT = r"[uv]mot\w*", r"imot\w*"
_MOTOR = rf"motor|mot|bridge|armature|actuator|h_?bridge|{_MOTOR_VOLTAGE}|{_MOTOR_CURRENT}"
# A word of these makes a signal something about a quantity, not the quantity.
ABOUT = (
    r"status|stat|sta|state|qbit|bit|valid|error|err|fehler\w*|fault|warn\w*|max|min|mx|limit\w*|grenze|gradient|delta|"
    r"sign|vz|vorzeichen|crc|checksum|checksumme|counter|cnt|bz|offset|offs|code|type|typ|frei|reserved|spare|einheit|"
    r"schutz|uebertemp|unterspannung|flag|mask|anf|begrenzun\w*|sollwertbegrenzun\w*|gross|zu|klein|norm\w*|maxnorm|"
    r"cruise|oder|or|idle|idlg|id"
)
_SAMPLE = r"samples?|smpl?|abtast\w*|mess\w*|meas"
_OTHER_PEDAL = r"brake\w*|brems\w*|clutch|kuppl\w*|steer\w*"
_HIGH_VOLTAGE = r"hv|high|cell|zelle|pack|bms|becm|traction|hvem|nominal"


@dataclass(frozen=True, slots=True)
class Rule:
    """Words of a role: every pattern of `words` must match.

    One of `better` makes the proposal stronger.

    `elsewhere` says whether a vehicle's signal may have the role without a word for the throttle in its own name.
    """

    role: str
    words: tuple[str, ...]
    better: str = ""
    never: str = ABOUT
    lengths: tuple[int, int] = (6, 64)  # bits: an analogue value has some
    needs_unit: bool = False
    is_flag: bool = False
    elsewhere: bool = False


_FLAG = (1, 16)
_PEDAL = r"pedal\w*|fahrpedal\w*|app|pps|accelerator\w*"

RULES = (
    Rule(
        "motor_current",
        (rf"current|curr|cur|strom|\w*strom|amps?|i|{_MOTOR_CURRENT}", rf"{_MOTOR}|{THROTTLE}"),
        needs_unit=True,
    ),
    Rule("motor_voltage", (rf"voltage|volt|spannung|\w*spannung|u|{_MOTOR_VOLTAGE}", _MOTOR), needs_unit=True),
    Rule("motor_duty", (r"duty|pwm|tastverh\w*|dutycycle",)),
    Rule(
        "motor_angle",
        (ANGLE, r"motor|mot|rotor|encoder|shaft|armature"),
        never=f"{ABOUT}|{THROTTLE}|turns?|pitch|roll",
        needs_unit=True,
    ),
    # A bare number may be degrees, volts or a share: without a unit nothing of the plate is proposed.
    Rule("throttle_angle", (THROTTLE,), better=ANGLE, never=f"{ABOUT}|{_PEDAL}", needs_unit=True),
    Rule(
        "throttle_opening",
        (THROTTLE,),
        better=rf"{ANGLE}|opening|abs|dkw|tps",
        never=f"{ABOUT}|{_PEDAL}",
        needs_unit=True,
    ),
    Rule(
        "throttle_position",
        (THROTTLE,),
        better=r"raw|volt\w*|sensor|track|adc",
        never=f"{ABOUT}|{_PEDAL}|{_MOTOR}|supply|duty|drive|coil",
        needs_unit=True,
    ),
    Rule(
        "pedal_position",
        (_PEDAL,),
        better=r"pos|position|\w*wert|wert|abs",
        never=f"{ABOUT}|{_OTHER_PEDAL}|epb|actu",
        needs_unit=True,
        elsewhere=True,
    ),
    Rule(
        "temperature",
        (r"temp|temperature|temperatur|\w*temperatur",),
        better=rf"{THROTTLE}|housing|gehaeuse|board",
        never=f"{ABOUT}|motor|winding|coil|fet|oil|water|air",
        needs_unit=True,
    ),
    Rule(
        "supply_voltage",
        (r"supply|batt|battery|ubat|vbat|kl30|bordnetz\w*|batteriespannung|vsupply|versorgung\w*",),
        never=f"{ABOUT}|{_HIGH_VOLTAGE}",
        needs_unit=True,
        elsewhere=True,
    ),
    Rule(
        "engine_speed",
        (r"rpm|drehzahl|motordrehzahl|kurbelwellendrehzahl|speed|n", r"engine|eng|motordrehzahl|kurbel\w*|mo\d*"),
        never=f"{ABOUT}|hyb|vm|dsply|hybrid|ev|idl|idle|mn|ntrl|filtered",
        needs_unit=True,
        elsewhere=True,
    ),
    Rule(
        "sample_counter",
        (_SAMPLE, r"count|counter|cntr?|ctr|number|nr|index|idx|\w*zaehler"),
        never=r"alive",
        lengths=(4, 32),
    ),
    Rule("mode", (r"mode|betriebsart|modus",), never=r"sleep", lengths=_FLAG, is_flag=True),
    Rule(
        "enable",
        (r"enable|enabled|bridge|driver", r"on|enable|enabled|active|ein"),
        never=r"error|err",
        lengths=(1, 2),
        is_flag=True,
    ),
    Rule("faults", (r"faults?|errors?|fehler|dtc",), never=r"crc|counter|cnt", lengths=(2, 32), is_flag=True),
    Rule("command_position", (ASKED, rf"{ANGLE}|{THROTTLE}"), better=THROTTLE, needs_unit=True),
    Rule("command_velocity", (ASKED, r"velocity|vel|omega|rate"), better=THROTTLE, needs_unit=True),
    Rule("command_voltage", (ASKED, r"voltage|volt|spannung"), needs_unit=True),
    Rule("command_duty", (ASKED, r"duty|pwm")),
    Rule("command_mode", (ASKED, r"mode|betriebsart"), never=r"crc", lengths=_FLAG, is_flag=True),
    Rule("request_signals", (r"request|req", r"signals?"), never=r"crc", lengths=_FLAG),
    Rule("request_rate", (r"request|req", r"rate|frequency"), never=r"crc"),
    Rule("request_burst", (r"request|req", r"burst"), never=r"crc", lengths=(1, 2)),
    Rule("request_duration", (r"request|req", r"duration"), never=r"crc"),
    Rule("controller_time", (r"controller|ecu", r"time|clock|uptime"), lengths=(16, 64)),
    Rule("command_enable", (ASKED, r"enable|on|ein"), never=r"crc", lengths=(1, 2), is_flag=True),
)
