"""Who sends next and when: compiled kernels of the virtual bus.

They work on plain integer arrays.

Rules of ISO 11898-1 that are modelled: arbitration over identifier, RTR and IDE; error counters; error-passive nodes
that suspend transmission for 8 bits; bus-off after 256 transmit errors and recovery after 128 sequences of 11
recessive bits. Every frame is acknowledged, even where nobody else is attached. Two nodes that send the same
identifier at once would destroy each other's frames; here the port opened first goes first.

Every port has a FIFO transmit queue, a ring of rows in `queue` (ports, capacity, columns) and `payload`. Frames that
are done go into the `log`, a ring of rows of the same shape, which every port reads at its own cursor.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.canio.bit_timing import INTERMISSION_BITS, one_frame_bits
from etb_hil.canio.bus.health import note_busy
from etb_hil.canio.frames import FrameFlag

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Ints = NDArray[np.int64]
    Bytes = NDArray[np.uint8]

# Columns of a row; in the queue the first three are when it was handed over, its arbitration key and its duration, in
# the log when it ended, who sent it and which ports see it (a bit each). TOLD: ports that know of it already.
STAMP, KEY, SPAN, IDENT, FLAGS, LENGTH, TOLD, ROW = range(8)
SOURCE, SEEN_BY = KEY, SPAN

# Columns of a port. OFF_LEFT: sequences of 11 recessive bits to go until bus-off ends, 0 while on the bus. LEAST: no
# key of its frames is below, 0 where nothing is known.
HEAD, TAIL, CURSOR, WAITING, OPEN, NODE, BLOCKED, TEC, REC, OFF_LEFT, SENT, RECEIVED, ERRORS, DROPPED = range(14)
LEAST, PORT = 14, 15

# The bus: when it is free, who sends from when to when, whether an error frame ends it, rows ever logged; constants.
FREE, SENDER, START, END, DESTROYED, LOGGED, NOMINAL, DATA, FD, LOOKAHEAD, BUS = range(11)

MAX_PORTS = 62  # a bit each in SEEN_BY
NEVER = np.iinfo(np.int64).max
NO_ROOM = -2  # what `enqueue` returns where a queue is too short

# Of ISO 11898-1: suspended transmission, error frame, and recovery from bus-off.
_SUSPEND_BITS = 8
_ERROR_FLAG_BITS = 6 + 8  # error flag and error delimiter
_RECOVERY_SEQUENCES = 128
_RECESSIVE_BITS = 11

_EXTENDED = int(FrameFlag.EXTENDED)
_REMOTE = int(FrameFlag.REMOTE)
_FD = int(FrameFlag.FD)
_ERROR = int(FrameFlag.ERROR)
_SENT = int(FrameFlag.SENT)


@njit(cache=True, error_model="numpy")
def time_ns(bits: int, rate: int) -> int:
    """Return how long `bits` take at `rate` bit/s, in whole nanoseconds."""
    return (bits * 1_000_000_000 + rate // 2) // rate


@njit(cache=True, error_model="numpy")
def enqueue(
    queue: Ints,
    payload: Bytes,
    ports: Ints,
    bus: Ints,
    port: int,
    stamp_ns: Ints,
    ident: NDArray[np.uint32],
    flags: Bytes,
    length: Bytes,
    data: Bytes,
    first_ns: int,
    last_ns: int,
    at_once: bool,
) -> int:
    """Append frames to a port's queue.

    Return -1, or the row that is out of order or that this bus cannot carry, or `NO_ROOM`.

    Stamps rise and lie between `first_ns` and `last_ns`; with `at_once` all is handed over at `last_ns` instead. No
    frame wins over what its port was said to send.
    """
    mask = queue.shape[1] - 1
    wide, room = data.shape[1], payload.shape[2]
    width, flat = min(wide, room), data.reshape(data.size)
    tail = ports[port, TAIL]
    if tail - ports[port, HEAD] + len(stamp_ns) > queue.shape[1]:
        return NO_ROOM
    for row in range(len(stamp_ns)):
        flag = int(flags[row])
        when = last_ns if at_once else stamp_ns[row]
        if when < first_ns or when > last_ns or flag & _ERROR or (flag & _FD and not bus[FD]):
            return row
        if length[row] > width and not flag & _REMOTE:
            return row
        key = arbitration_key(int(ident[row]), flag)
        if key < ports[port, LEAST]:
            return row
        first_ns = when
        slot = (tail + row) & mask
        queue[port, slot, STAMP], queue[port, slot, KEY], queue[port, slot, TOLD] = when, key, 0
        nominal, fast = one_frame_bits(ident[row], flags[row], length[row], flat, row * wide, wide)
        span = time_ns(int(nominal) - INTERMISSION_BITS, bus[NOMINAL]) + time_ns(int(fast), bus[DATA])
        queue[port, slot, SPAN] = span
        queue[port, slot, IDENT] = ident[row]
        queue[port, slot, FLAGS] = flag & ~_SENT
        queue[port, slot, LENGTH] = length[row]
        for column in range(width):
            payload[port, slot, column] = data[row, column]
        for column in range(width, room):
            payload[port, slot, column] = 0
    ports[port, TAIL] += len(stamp_ns)
    return -1


@njit(cache=True, error_model="numpy")
def arbitration_key(ident: int, flag: int) -> int:
    """Return the bits from identifier to RTR, of which the lower number wins."""
    remote = 1 if flag & _REMOTE else 0
    if flag & _EXTENDED:  # SRR and IDE are recessive
        return (ident >> 18 & 0x7FF) << 21 | 3 << 19 | (ident & 0x3FFFF) << 1 | remote
    return (ident & 0x7FF) << 21 | remote << 20


@njit(cache=True, error_model="numpy")
def horizon(queue: Ints, ports: Ints, bus: Ints, now_ns: int, until_ns: int) -> int:
    """Return up to when every node may run at once.

    Before it no frame of somebody else can reach any of them.
    """
    mask = queue.shape[1] - 1
    sender = bus[SENDER]
    free = bus[END] if sender >= 0 else bus[FREE]
    nodes = 0
    for node in range(len(ports)):
        if not ports[node, OPEN] or not ports[node, NODE]:
            continue
        nodes += 1
        for port in range(len(ports)):
            if port == node or not ports[port, OPEN]:
                continue
            if port == sender:
                until_ns = min(until_ns, bus[END])
            elif ports[port, HEAD] < ports[port, TAIL]:
                row = queue[port, ports[port, HEAD] & mask]
                until_ns = min(until_ns, max(free, row[STAMP], now_ns) + row[SPAN])
    if nodes > 1:  # what one node hands over in this segment must not reach another within it
        until_ns = min(until_ns, now_ns + bus[LOOKAHEAD])
    return until_ns


@njit(cache=True, error_model="numpy")
def foretell(
    queue: Ints, payload: Bytes, ports: Ints, bus: Ints, log: Ints, log_payload: Bytes, now_ns: int, until_ns: int
) -> bool:
    """Let the one node hear now of the one frame that waits for it.

    The kernel does where nothing can keep the frame from ending in time.

    The bus must be free and undisturbed, and the frame win over all that the node may send; then the node can live
    past its end in one go.
    """
    mask = queue.shape[1] - 1
    node, sender = -1, -1
    for port in range(len(ports)):
        if not ports[port, OPEN]:
            continue
        if ports[port, OFF_LEFT] > 0 or (ports[port, NODE] and node >= 0):
            return False
        if ports[port, NODE]:
            node = port
        elif ports[port, HEAD] < ports[port, TAIL]:
            if sender >= 0 or ports[port, TAIL] - ports[port, HEAD] > 1:
                return False
            sender = port
    if node < 0 or sender < 0 or bus[SENDER] >= 0 or ports[node, WAITING] >= len(log) - 1:
        return False
    row = queue[sender, ports[sender, HEAD] & mask]
    start = max(bus[FREE], row[STAMP], now_ns)
    end = start + row[SPAN]
    beaten = row[KEY] >= ports[node, LEAST] or row[STAMP] > now_ns or ports[sender, BLOCKED] > start
    if beaten or row[TOLD] or end > until_ns or bus[LOGGED] - oldest_unread(ports, bus) >= len(log):
        return False
    row[TOLD] = 1 << node
    told = row.copy()
    told[STAMP], told[SOURCE], told[SEEN_BY] = end, sender, 1 << node
    append(log, log_payload, ports, bus, told, payload[sender, ports[sender, HEAD] & mask])
    return True


@njit(cache=True, error_model="numpy")
def next_end(queue: Ints, ports: Ints, bus: Ints, now_ns: int) -> int:
    """Return before when no frame that is known now can end, `NEVER` where none is."""
    mask = queue.shape[1] - 1
    if bus[SENDER] >= 0:
        return bus[END]
    end = NEVER
    for port in range(len(ports)):
        if ports[port, OPEN] and ports[port, HEAD] < ports[port, TAIL]:
            row = queue[port, ports[port, HEAD] & mask]
            end = min(end, max(bus[FREE], row[STAMP], now_ns) + row[SPAN])
    return end


@njit(cache=True, error_model="numpy")
def start_next(queue: Ints, ports: Ints, bus: Ints, until_ns: int) -> bool:
    """Let the queues' heads arbitrate.

    Return whether a frame started before `until_ns`.
    """
    mask = queue.shape[1] - 1
    start = _next_start(queue, ports, bus, until_ns)
    if start >= until_ns:
        return False
    idle = (start - bus[FREE]) // time_ns(_RECESSIVE_BITS, bus[NOMINAL])
    best = NEVER
    for port in range(len(ports)):
        if ports[port, OFF_LEFT] > 0:
            ports[port, OFF_LEFT] -= idle
        elif ports[port, OPEN] and ports[port, HEAD] < ports[port, TAIL]:
            row = queue[port, ports[port, HEAD] & mask]
            if max(row[STAMP], ports[port, BLOCKED]) <= start and row[KEY] < best:
                best = row[KEY]
                bus[SENDER] = port
                bus[END] = start + row[SPAN]
    bus[START] = start
    bus[DESTROYED] = 0
    return True


@njit(cache=True, error_model="numpy")
def _next_start(queue: Ints, ports: Ints, bus: Ints, until_ns: int) -> int:
    """Return when the next frame starts, `NEVER` where none is queued.

    Ports that recover until then are back.
    """
    mask = queue.shape[1] - 1
    while True:
        start, recovery, recovering = NEVER, until_ns, -1
        for port in range(len(ports)):
            if ports[port, OFF_LEFT] > 0:
                when = bus[FREE] + ports[port, OFF_LEFT] * time_ns(_RECESSIVE_BITS, bus[NOMINAL])
                if when < recovery:
                    recovery, recovering = when, port
            elif ports[port, OPEN] and ports[port, HEAD] < ports[port, TAIL]:
                ready = max(queue[port, ports[port, HEAD] & mask, STAMP], ports[port, BLOCKED])
                start = min(start, max(ready, bus[FREE]))
        if recovering < 0 or recovery > start:
            return start
        _recover(ports, recovering, recovery)


@njit(cache=True, error_model="numpy")
def _recover(ports: Ints, port: int, when_ns: int) -> None:
    ports[port, OFF_LEFT] = ports[port, TEC] = ports[port, REC] = 0
    ports[port, BLOCKED] = when_ns


@njit(cache=True, error_model="numpy")
def append(log: Ints, log_payload: Bytes, ports: Ints, bus: Ints, row: Ints, data: Bytes) -> None:
    """Write one row into the log and tell the ports that see it."""
    slot = bus[LOGGED] & (len(log) - 1)
    for column in range(ROW):
        log[slot, column] = row[column]
    for column in range(len(data)):
        log_payload[slot, column] = data[column]
    bus[LOGGED] += 1
    for port in range(len(ports)):
        if row[SEEN_BY] >> port & 1 and ports[port, OPEN]:
            ports[port, WAITING] += 1
            if row[FLAGS] & _ERROR:
                ports[port, ERRORS] += 1
            elif port != row[SOURCE]:
                ports[port, RECEIVED] += 1


@njit(cache=True, error_model="numpy")
def audience(ports: Ints, sender: int) -> int:
    """Return which ports see a frame, a bit each.

    All on the bus do, but nodes see neither their own nor error frames (-1).
    """
    seen_by = 0
    for port in range(len(ports)):
        on_bus = ports[port, OPEN] != 0 and ports[port, OFF_LEFT] == 0
        if on_bus and (ports[port, NODE] == 0 or (sender >= 0 and port != sender)):
            seen_by |= 1 << port
    return seen_by


@njit(cache=True, error_model="numpy")
def finish(queue: Ints, payload: Bytes, ports: Ints, bus: Ints, meter: Ints) -> tuple[Ints, Bytes]:
    """End the frame under way in success.

    Return its row as it stands in the log, and its payload.
    """
    sender = bus[SENDER]
    slot = ports[sender, HEAD] & (queue.shape[1] - 1)
    row = queue[sender, slot]
    row[STAMP], row[SOURCE], row[SEEN_BY] = bus[END], sender, audience(ports, sender) & ~row[TOLD]
    ports[sender, HEAD] += 1
    ports[sender, SENT] += 1
    ports[sender, TEC] = max(ports[sender, TEC] - 1, 0)
    _release(ports, bus, meter)
    for port in range(len(ports)):
        if port != sender and ports[port, REC] > 0:
            ports[port, REC] = min(ports[port, REC] - 1, 120)  # "a value between 119 and 127" after error passive
    return row, payload[sender, slot]


@njit(cache=True, error_model="numpy")
def destroy(ports: Ints, bus: Ints, meter: Ints) -> None:
    """End the frame under way by an error frame.

    Its sender will try again, or goes bus-off.
    """
    sender = bus[SENDER]
    for port in range(len(ports)):
        if port != sender and ports[port, OPEN] and ports[port, OFF_LEFT] == 0:
            ports[port, REC] = min(ports[port, REC] + 1, 255)
    bus[DESTROYED] = 0
    ports[sender, TEC] += 8
    _release(ports, bus, meter)
    if ports[sender, TEC] > 255:
        ports[sender, OFF_LEFT] = _RECOVERY_SEQUENCES


@njit(cache=True, error_model="numpy")
def spoil(bus: Ints) -> None:
    """Mark the frame under way as destroyed in the last bit of its end.

    There it costs the bus most.
    """
    bus[DESTROYED] = 1
    bus[END] += time_ns(_ERROR_FLAG_BITS, bus[NOMINAL])


@njit(cache=True, error_model="numpy")
def _release(ports: Ints, bus: Ints, meter: Ints) -> None:
    sender = bus[SENDER]
    bus[FREE] = bus[END] + time_ns(INTERMISSION_BITS, bus[NOMINAL])
    bus[SENDER] = -1
    note_busy(meter, bus[FREE], bus[FREE] - bus[START])
    if ports[sender, TEC] > 127 or ports[sender, REC] > 127:
        ports[sender, BLOCKED] = bus[FREE] + time_ns(_SUSPEND_BITS, bus[NOMINAL])
    for port in range(len(ports)):  # acknowledge delimiter, end of frame and intermission are 11 recessive bits
        if ports[port, OFF_LEFT] > 0:
            ports[port, OFF_LEFT] -= 1
            if ports[port, OFF_LEFT] == 0:
                _recover(ports, port, bus[FREE])


@njit(cache=True, error_model="numpy")
def oldest_unread(ports: Ints, bus: Ints) -> int:
    """Return the first row of the log that some port still wants."""
    oldest = bus[LOGGED]
    for port in range(len(ports)):
        if ports[port, WAITING] == 0:
            ports[port, CURSOR] = bus[LOGGED]
        oldest = min(oldest, ports[port, CURSOR])
    return oldest


@njit(cache=True, error_model="numpy")
def transmit(
    queue: Ints, payload: Bytes, ports: Ints, bus: Ints, log: Ints, log_payload: Bytes, meter: Ints, until_ns: int
) -> bool:
    """Send what is queued until `until_ns`.

    Return False where the log is full before that.
    """
    oldest = oldest_unread(ports, bus)
    while True:
        if bus[SENDER] < 0 and not start_next(queue, ports, bus, until_ns):
            return True
        if bus[END] > until_ns:
            return True
        if bus[LOGGED] - oldest >= len(log):
            return False
        row, data = finish(queue, payload, ports, bus, meter)
        append(log, log_payload, ports, bus, row, data)


@njit(cache=True, error_model="numpy")
def forget(log: Ints, ports: Ints, bus: Ints, keep: int) -> None:
    """Let ports that lag by more than `keep` rows lose the oldest, and count them."""
    for port in range(len(ports)):
        for index in range(ports[port, CURSOR], bus[LOGGED] - keep):
            if log[index & (len(log) - 1), SEEN_BY] >> port & 1:
                ports[port, WAITING] -= 1
                ports[port, DROPPED] += 1
        ports[port, CURSOR] = max(ports[port, CURSOR], bus[LOGGED] - keep)


@njit(cache=True, error_model="numpy")
def collect(
    log: Ints,
    log_payload: Bytes,
    ports: Ints,
    bus: Ints,
    port: int,
    stamp_ns: Ints,
    ident: NDArray[np.uint32],
    flags: Bytes,
    length: Bytes,
    data: Bytes,
) -> None:
    """Write what a port has not read yet into columns of a `FrameBlock`.

    These are `ports[port, WAITING]` frames.
    """
    mask = len(log) - 1
    done = 0
    for index in range(ports[port, CURSOR], bus[LOGGED]):
        row = index & mask
        if not log[row, SEEN_BY] >> port & 1:
            continue
        stamp_ns[done], ident[done], length[done] = log[row, STAMP], log[row, IDENT], log[row, LENGTH]
        flags[done] = log[row, FLAGS] | (_SENT if log[row, SOURCE] == port else 0)
        for column in range(log_payload.shape[1]):
            data[done, column] = log_payload[row, column]
        done += 1
    ports[port, CURSOR] = bus[LOGGED]
    ports[port, WAITING] = 0
