"""Every fault of the study: what it is called, and how one of a random time and size is put on a bench."""
# ruff: noqa: ARG001, ARG002, ARG005 (every case and every change has one signature)

from dataclasses import dataclass, field

import numpy as np
from faults_nodes import (
    MS,
    Babbler,
    Deaf,
    Late,
    OtherBench,
    OwnClock,
    Resetting,
    Rewriting,
    SetBackStamps,
    ShiftedStamps,
)

from etb_hil.canio.bus.faults import (
    Corrupted,
    CounterJump,
    Delayed,
    Duplicated,
    ErrorFrames,
    Forged,
    Lost,
    Reordered,
    StuckCounter,
    Window,
    protections_of,
)

S = 1_000 * MS
LAST = 23 * S  # the check takes 24 s
SENSORS = ("motor_current", "motor_angle", "throttle_angle", "throttle_angle_2")


@dataclass
class Injected:
    """What one fault needs: faults of the bus, more nodes, what spoils the controller, what spoils the link."""

    bus: list = field(default_factory=list)
    nodes: list = field(default_factory=list)
    spoil: list = field(default_factory=list)  # node -> node
    make: object = None  # (make, dialect) -> node, for faults that switch the controller off
    link: list = field(default_factory=list)  # link -> link
    note: str = ""


def _ids(dialect, *, commands=False):
    return frozenset(m.ident for m in dialect.messages if m.commanded is commands)


def _window(rng, low_ms, high_ms, idents=None):
    start = int(rng.uniform(0.2 * S, LAST))
    length = int(np.exp(rng.uniform(np.log(low_ms), np.log(high_ms))) * MS)
    return Window(start, start + length, idents)


def _bus(kind, low_ms, high_ms, **settings):
    def build(rng, dialect):
        window = _window(rng, low_ms, high_ms, _ids(dialect, commands=bool(rng.integers(4) == 0)))
        made = kind(window, **{key: value(rng, dialect) for key, value in settings.items()})
        length = (window.until_ns - window.from_ns) / MS
        return Injected(bus=[made], note=f"{window.from_ns / S:.2f} s for {length:.0f} ms")

    return build


def _protections(rng, dialect):
    return protections_of(dialect)


def _few_ms(rng, dialect):
    return int(rng.uniform(0.3, 30.0) * MS)


def _flip(rng, dialect):
    flip = bytearray(8)
    flip[rng.integers(8)] = 1 << rng.integers(8)
    return bytes(flip)


def _forged_flip(rng, dialect):
    return bytes([1 << int(rng.integers(8))])


def _forged_first(rng, dialect):
    return int(rng.integers(3, 8))


def _bus_off(rng, dialect):
    window = _window(rng, 15, 60, _ids(dialect))
    return Injected(bus=[ErrorFrames(window)], note=f"{window.from_ns / S:.2f} s")


def _overload(rng, dialect):
    window = _window(rng, 20, 1500)
    period = int(rng.choice([60_000, 100_000, 150_000, 200_000]))
    babbler = Babbler(window.from_ns, window.until_ns, 0x001, period)
    return Injected(
        nodes=[babbler], note=f"{window.from_ns / S:.2f} s, {(window.until_ns - window.from_ns) / MS:.0f} ms"
    )


def _reset(rng, dialect):
    at, boot, resumes = int(rng.uniform(0.2 * S, LAST)), int(rng.uniform(5, 80) * MS), bool(rng.integers(2))
    return Injected(
        make=lambda make, d: Resetting(make, d, at, boot, resumes=resumes),
        note=f"{at / S:.2f} s, back after {boot / MS:.0f} ms, {'resumes' if resumes else 'waits'}",
    )


def _hang(rng, dialect):
    window = _window(rng, 5, 500)
    length = window.until_ns - window.from_ns
    kind = int(rng.integers(2))
    spoil = (
        (lambda node: OwnClock(node, at_ns=window.from_ns, hang_ns=length))
        if kind
        else (lambda node: Deaf(node, window.from_ns, length))
    )
    note = f"{window.from_ns / S:.2f} s for {length / MS:.0f} ms, {'stands still' if kind else 'deaf'}"
    return Injected(spoil=[spoil], note=note)


def _late(rng, dialect):
    at, delay = int(rng.uniform(0.2 * S, LAST)), int(np.exp(rng.uniform(np.log(2), np.log(300))) * MS)
    return Injected(spoil=[lambda node: Late(node, at, delay)], note=f"from {at / S:.2f} s by {delay / MS:.0f} ms")


def _late_always(rng, dialect):
    delay = int(np.exp(rng.uniform(np.log(2), np.log(300))) * MS)
    return Injected(spoil=[lambda node: Late(node, 0, delay)], note=f"always by {delay / MS:.0f} ms")


def _other_request(rng, dialect):
    kind = int(rng.integers(3))

    def change(role, values, stamp_ns):
        if role == "request_rate" and kind == 0:
            return np.full_like(values, rate)
        if role == "request_signals" and kind == 1:
            return np.ones_like(values)
        if role == "request_duration" and kind == 2:
            return np.full_like(values, 2.0)
        return None

    rate = float(rng.choice([50.0, 100.0, 250.0, 500.0]))
    note = (f"samples at {rate:.0f} Hz", "current alone", "for 2 s")[kind]
    return Injected(spoil=[lambda node: Rewriting(node, dialect, 0, 1 << 62, change, heard=True)], note=note)


def _other_bench(rng, dialect):
    window = _window(rng, 10, 3000)
    enable, position = bool(rng.integers(2)), float(rng.uniform(0.1, 1.3))
    node = OtherBench(dialect, window.from_ns, window.until_ns, enable=enable, position=position)
    note = (
        f"{window.from_ns / S:.2f} s for {(window.until_ns - window.from_ns) / MS:.0f} ms, {'on' if enable else 'off'}"
    )
    return Injected(nodes=[node], note=note)


class _Held:
    """Values of a role as they were first seen, from burst to burst."""

    def __init__(self, roles):
        self._roles, self._first = roles, {}

    def __call__(self, role, values, stamp_ns):
        if role not in self._roles:
            return None
        first = self._first.setdefault(role, values[:1, :1].copy())
        return np.broadcast_to(first, values.shape)


def _sensor_window(rng):
    at = int(rng.uniform(0.2 * S, LAST))
    length = int(np.exp(rng.uniform(np.log(30), np.log(20_000))) * MS)
    return at, at + length


def _frozen(rng, dialect):
    at, until = _sensor_window(rng)
    which = SENSORS[: 1 + int(rng.integers(4))] if rng.integers(4) == 0 else (SENSORS[int(rng.integers(4))],)
    if which == SENSORS[1:]:
        which = SENSORS
    held = _Held({*which, *({"turns"} if "motor_angle" in which else ())})
    note = f"{'+'.join(which)} {at / S:.2f} s for {(until - at) / S:.2f} s"
    return Injected(spoil=[lambda node: Rewriting(node, dialect, at, until, held)], note=note)


def _jump(rng, dialect):
    at, until = _sensor_window(rng)
    role = SENSORS[int(rng.integers(4))]
    size = {"motor_current": 3.0, "motor_angle": 3.0}.get(role, 0.4)
    offset = float(rng.choice([-1.0, 1.0]) * size * np.exp(rng.uniform(np.log(0.01), 0.0)))

    def change(name, values, stamp_ns):
        if name != role:
            return None
        moved = values + offset
        return np.clip(moved, -0.0437, 1.526) if role.startswith("throttle") else moved

    note = f"{role} by {offset:+.3f} at {at / S:.2f} s for {(until - at) / S:.2f} s"
    return Injected(spoil=[lambda node: Rewriting(node, dialect, at, until, change)], note=note)


def _saturated(rng, dialect):
    at, until = _sensor_window(rng)
    role = SENSORS[int(rng.integers(4))]
    high = {"motor_current": 4.0, "motor_angle": 20.0}.get(role, 1.3) * rng.uniform(0.05, 0.8)

    def change(name, values, stamp_ns):
        if name != role:
            return None
        return np.clip(values, -high if role == "motor_current" else None, high)

    note = f"{role} at {high:.2f} from {at / S:.2f} s for {(until - at) / S:.2f} s"
    return Injected(spoil=[lambda node: Rewriting(node, dialect, at, until, change)], note=note)


def _scaled(rng, dialect):
    role = SENSORS[int(rng.integers(4))]
    gain = float(rng.choice([0.3, 0.5, 0.8, 1.25, 1.6, 2.5]))

    def change(name, values, stamp_ns):
        if name != role:
            return None
        return np.clip(values * gain, -0.0437, 1.526) if role.startswith("throttle") else values * gain

    return Injected(spoil=[lambda node: Rewriting(node, dialect, 0, 1 << 62, change)], note=f"{role} x {gain}")


def _second_track(rng, dialect):
    at, until = _sensor_window(rng)
    offset = float(rng.choice([-1.0, 1.0]) * np.exp(rng.uniform(np.log(0.005), np.log(0.5))))

    def change(name, values, stamp_ns):
        return np.clip(values + offset, -0.0437, 1.526) if name == "throttle_angle_2" else None

    note = f"by {offset:+.3f} rad at {at / S:.2f} s for {(until - at) / S:.2f} s"
    return Injected(spoil=[lambda node: Rewriting(node, dialect, at, until, change)], note=note)


def _drift(rng, dialect):
    drift = float(rng.choice([-1.0, 1.0]) * np.exp(rng.uniform(np.log(1e-5), np.log(0.1))))
    return Injected(spoil=[lambda node: OwnClock(node, drift=drift)], note=f"{drift * 1e6:+.0f} ppm")


def _counter_step(rng, dialect):
    at = int(rng.uniform(0.2 * S, LAST))
    step = int(rng.choice([-1, 1]) * np.exp(rng.uniform(0.0, np.log(60_000))))

    def change(role, values, stamp_ns):
        return values + step if role == "sample_counter" else None

    return Injected(
        spoil=[lambda node: Rewriting(node, dialect, at, 1 << 62, change)], note=f"by {step:+d} at {at / S:.2f} s"
    )


def _counter_stuck(rng, dialect):
    at, until = _sensor_window(rng)
    held = _Held({"sample_counter"})
    note = f"{at / S:.2f} s for {(until - at) / S:.2f} s"
    return Injected(spoil=[lambda node: Rewriting(node, dialect, at, until, held)], note=note)


def _stamps(rng, dialect):
    at = int(rng.uniform(0.2 * S, LAST))
    step = int(rng.choice([-1.0, 1.0]) * np.exp(rng.uniform(np.log(1e-3), np.log(3600.0))) * S)
    return Injected(link=[lambda link: ShiftedStamps(link, at, step)], note=f"{step / S:+.3f} s at {at / S:.2f} s")


def _set_back(rng, dialect):
    step, every = int(np.exp(rng.uniform(np.log(0.1), np.log(5.0))) * MS), int(rng.uniform(3.0, 100.0) * MS)
    note = f"by {step / MS:.2f} ms every {every / MS:.0f} ms"
    return Injected(link=[lambda link: SetBackStamps(link, step, every)], note=note)


CASES = {
    "frames lost": _bus(Lost, 1, 1500),
    "frames duplicated": _bus(Duplicated, 1, 3000, delay_ns=_few_ms),
    "frames delayed": _bus(Delayed, 1, 1500, delay_ns=_few_ms),
    "frames reordered": _bus(Reordered, 1, 3000, delay_ns=_few_ms),
    "wrong CRC": _bus(Corrupted, 1, 1500, flip=_flip),
    "right CRC, one frame": _bus(Forged, 1, 1.01, protections=_protections, flip=_forged_flip, first=_forged_first),
    "right CRC, a stretch": _bus(Forged, 5, 1500, protections=_protections, flip=_forged_flip, first=_forged_first),
    "counter jump": _bus(CounterJump, 1, 1500, protections=_protections, jump=lambda rng, d: int(rng.integers(1, 16))),
    "stuck counter": _bus(StuckCounter, 1, 1500, protections=_protections),
    "error frames": _bus(ErrorFrames, 0.2, 10),
    "bus-off": _bus_off,
    "overload": _overload,
    "controller resets": _reset,
    "controller hangs": _hang,
    "answers late": _late,
    "answers late always": _late_always,
    "another request": _other_request,
    "another bench": _other_bench,
    "sensor frozen": _frozen,
    "sensor jumps": _jump,
    "sensor saturated": _saturated,
    "sensor gain": _scaled,
    "second track": _second_track,
    "clock drifts": _drift,
    "sample clock steps": _counter_step,
    "sample clock stuck": _counter_stuck,
    "stamps step": _stamps,
    "stamps set back often": _set_back,
}
