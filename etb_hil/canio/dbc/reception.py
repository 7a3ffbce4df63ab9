"""Which received frames are accepted, in one compiled pass.

The pass tells when their samples were taken, and how many were lost before.

Frames are taken one by one in the order in which they came, with the state of every message kept from call to call, so
that nothing depends on how a stream was cut into blocks.

Sample time. All sample counters of a dialect count one clock of the controller, each to its own width. A frame's place
on that clock is first predicted from its stamp and from the last frame of any message; its counter then decides among
the places that have its low bits. The first frame of a message is aligned by the width of the narrowest counter, so
that samples of one instant get one time whichever message comes first. The first sample's time is its stamp.

Loss. The alive counter says how many frames are missing within its wrap, the sample counter within its own; where both
agree with the interval that the message keeps, the count is exact.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.canio.dbc.protection import counter_at, is_right_at
from etb_hil.canio.dbc.signal_bits import raw_bits
from etb_hil.canio.frames import FrameFlag
from etb_hil.recording.samples import LOSS_UNKNOWN

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Int64 = NDArray[np.int64]
    Bytes = NDArray[np.uint8]

# Columns of the table of messages.
IDENT, EXTENDED, LENGTH, PROFILE, MODULUS, TICK, COUNTER_BITS, CYCLE, COMMANDED, REQUEST, INTERVAL = range(11)
# Columns of the state of a message; `KNOWN_INTERVAL` is in ticks from frame to frame, 0 while it is not known.
SEEN, ALIVE, STAMP, PLACE, SHIFT, KNOWN_INTERVAL, LAST_STEP, FRESH, REPEATS, TIME = range(10)
# Columns of the counts of a message.
FRAMES, TOO_SHORT, CRC_FAILURES, REPEATED, STUCK, JUMPS, LOST, UNKNOWN, BACKWARDS, FOREIGN = range(10)
# The sample clock that all messages share.
RUNNING, CLOCK_PLACE, CLOCK_STAMP, EPOCH, NARROWEST = range(5)

AGAIN = -2  # a frame with samples of an earlier place has `AGAIN - k`, k the message's row
STUCK_AFTER = 3  # so many repeats in a row are no longer a doubled frame

_NO_DATA = int(FrameFlag.REMOTE | FrameFlag.ERROR)
_EXTENDED = int(FrameFlag.EXTENDED)
_SENT = int(FrameFlag.SENT)
_UNKNOWN = np.int64(LOSS_UNKNOWN)
_NOTHING = np.int64(0)
_NEAR = 4  # wraps of a counter to either side of the prediction that are tried
# Ticks between a place and its stamp after a request, up to which it was a pause, whatever the counters say. A host
# that stalls is late by whole wraps to within so little in 5 of 4,096 cases; a controller pauses after each request.
_JITTER = 2


@njit(cache=True, error_model="numpy")
def receive(
    stamp_ns: Int64,
    ident: NDArray[np.uint32],
    flags: Bytes,
    length: Bytes,
    data: Bytes,
    table: Int64,
    data_ids: NDArray[np.uint16],
    counter_places: Int64,
    state: Int64,
    counts: Int64,
    clock: Int64,
    out: Int64,
) -> None:
    """Fill `out` (3, n) with the acceptance of each frame.

    The three are the message's row in `table`, the time of the first sample, and the frames lost before. Of a refused
    frame the first is -1, or says of which message it repeats samples (`AGAIN`).
    """
    count, width = data.shape
    payloads, places, ids = data.reshape(count * width), counter_places.ravel(), data_ids.ravel()
    _select(ident, flags, length, width, payloads, table, ids, counts, out)
    # A helper that takes arrays costs more than this loop: for what is due, as nearly all frames are, scalars must do.
    for n in range(count):
        k = out[0, n]
        if k < 0:
            continue
        start, stamp = np.int64(n * width), stamp_ns[n]
        step, alive, counter = np.int64(-1), _NOTHING, _NOTHING
        if table[k, MODULUS]:
            alive = counter_at(payloads, start, table[k, PROFILE])
            if state[k, SEEN]:
                step = (alive - state[k, ALIVE]) & (table[k, MODULUS] - 1)
        if table[k, COUNTER_BITS]:
            counter = np.int64(raw_bits(payloads, start, places, k * 12))
        interval = state[k, KNOWN_INTERVAL]
        place = state[k, PLACE] + interval
        beside = counter + state[k, SHIFT] - place
        late = stamp - clock[CLOCK_STAMP] - (place - clock[CLOCK_PLACE]) * table[k, TICK]
        if step == 1 and _is_due(beside, table[k, COUNTER_BITS], interval, late, table[k, TICK]):
            state[k, ALIVE], state[k, STAMP], state[k, PLACE], state[k, LAST_STEP] = alive, stamp, place, interval
            state[k, REPEATS], state[k, FRESH] = 0, 0
            clock[CLOCK_PLACE], clock[CLOCK_STAMP] = place, stamp
            counts[k, FRAMES] += 1
            out[1, n], out[2, n] = clock[EPOCH] + place * table[k, TICK], 0
        else:
            is_sent = flags[n] & _SENT != 0
            _settle(np.int64(n), stamp, is_sent, step, alive, counter, k, table, state, counts, clock, out)


@njit(cache=True, error_model="numpy")
def _select(
    ident: NDArray[np.uint32],
    flags: Bytes,
    length: Bytes,
    width: int,
    payloads: Bytes,
    table: Int64,
    data_ids: NDArray[np.uint16],
    counts: Int64,
    out: Int64,
) -> None:
    """Write into `out[0]` the message of each good frame, -1 for the others.

    A good frame is long enough and has its CRC.
    """
    for n in range(len(ident)):
        k = _message_of(ident[n], flags[n], table)
        if k >= 0 and min(length[n], width) < table[k, LENGTH]:
            counts[k, TOO_SHORT] += 1
            k = np.int64(-1)
        if k >= 0 and not is_right_at(payloads, n * width, table[k, LENGTH], table[k, PROFILE], data_ids, k * 16):
            counts[k, CRC_FAILURES] += 1
            k = np.int64(-1)
        out[0, n] = k


@njit(cache=True, error_model="numpy", forceinline=True)
def _message_of(ident: np.uint32, flag: np.uint8, table: Int64) -> np.int64:
    if flag & _NO_DATA:
        return np.int64(-1)
    extended = np.int64(1 if flag & _EXTENDED else 0)
    for k in range(len(table)):
        if table[k, IDENT] == ident and table[k, EXTENDED] == extended:
            # What this side sent measures nothing, even where it bears the id of a measurement.
            return np.int64(k if table[k, COMMANDED] or not flag & _SENT else -1)
    return np.int64(-1)


@njit(cache=True, error_model="numpy", forceinline=True)
def _is_due(beside: np.int64, bits: np.int64, interval: np.int64, late: np.int64, tick: np.int64) -> bool:
    """Return whether a counter is at the place that follows.

    The counter may be whole wraps beside it, where the stamp says which.
    """
    modulus = np.int64(1) << bits
    return bool(interval > 0 and beside & (modulus - 1) == 0 and 2 * abs(late) < modulus * tick)


@njit(cache=True, error_model="numpy")
def _settle(
    n: np.int64,
    stamp: np.int64,
    is_sent: bool,
    step: np.int64,
    alive: np.int64,
    counter: np.int64,
    k: np.int64,
    table: Int64,
    state: Int64,
    counts: Int64,
    clock: Int64,
    out: Int64,
) -> None:
    """Accept a frame that is not simply the next one, or refuse it as a repeat."""
    if table[k, COUNTER_BITS]:
        accepted, time, lost = _by_counter(stamp, counter, step, k, table, state, clock)
    else:
        accepted, time, lost = _by_stamp(stamp, is_sent, step, k, table, state, counts)
    state[k, STAMP] = stamp  # of repeats too, so that a counter that stays stuck is never taken for one whole wrap
    if accepted:
        state[k, SEEN], state[k, ALIVE], state[k, TIME] = 1, alive, time
        state[k, REPEATS], state[k, FRESH] = 0, 0
        if table[k, REQUEST]:
            state[:, FRESH] = 1  # what comes next may come at another rate, and after a pause
        _count(step, lost, k, counts)
        out[1, n], out[2, n] = time, lost
    else:
        is_behind = table[k, COUNTER_BITS] and (time < 0 or (time == 0 and step == 0))
        out[0, n] = AGAIN - k if is_behind else -1
        counts[k, REPEATED] += 1
        state[k, REPEATS] += 1
        counts[k, STUCK] += state[k, REPEATS] == STUCK_AFTER


@njit(cache=True, error_model="numpy")
def _count(step: np.int64, lost: np.int64, k: np.int64, counts: Int64) -> None:
    counts[k, FRAMES] += 1
    counts[k, JUMPS] += step > 1
    if lost == _UNKNOWN:
        counts[k, UNKNOWN] += 1
    else:
        counts[k, LOST] += lost


@njit(cache=True, error_model="numpy")
def _by_counter(
    stamp: np.int64, counter: np.int64, step: np.int64, k: np.int64, table: Int64, state: Int64, clock: Int64
) -> tuple[bool, np.int64, np.int64]:
    """Return whether a frame with a sample counter is new, and its time.

    The frames lost before it are returned, too. Of a frame that is not new, by how many ticks it moved on is returned.
    """
    if not clock[RUNNING]:
        clock[RUNNING], clock[EPOCH] = 1, stamp - counter * table[k, TICK]
        clock[CLOCK_PLACE], clock[CLOCK_STAMP] = counter, stamp
    place = _place(stamp, counter, step, k, table, state, clock)
    moved = place - state[k, PLACE]
    lost = _NOTHING
    if state[k, SEEN]:
        if moved <= 0:
            return False, moved, _NOTHING
        lost = _lost(moved, step, k, table, state)
        if step == 0 and lost <= 0:
            state[k, PLACE] = place
            return False, moved, _NOTHING  # new samples under an old alive counter: it is stuck
        _learn_interval(moved, step, k, state)
    state[k, PLACE] = place
    clock[CLOCK_PLACE], clock[CLOCK_STAMP] = place, stamp
    return True, clock[EPOCH] + place * table[k, TICK], lost


@njit(cache=True, error_model="numpy", forceinline=True)
def _nearest(value: np.int64, to: np.int64, modulus: np.int64) -> np.int64:
    """Return the integer nearest to `to` that is `value` modulo `modulus`.

    The modulus is a power of two.
    """
    half = modulus // 2
    return to + ((value - to + half) & (modulus - 1)) - half


@njit(cache=True, error_model="numpy")
def _place(
    stamp: np.int64, counter: np.int64, step: np.int64, k: np.int64, table: Int64, state: Int64, clock: Int64
) -> np.int64:
    """Return a frame's place on the sample clock, in ticks."""
    tick = table[k, TICK]
    expected = clock[CLOCK_PLACE] + (stamp - clock[CLOCK_STAMP] + tick // 2) // tick
    if not state[k, SEEN]:
        place = _nearest(counter, expected, clock[NARROWEST])
        state[k, SHIFT] = place - counter
        return place
    modulus = np.int64(1) << table[k, COUNTER_BITS]
    place = _nearest(counter + state[k, SHIFT], expected, modulus)
    interval = state[k, KNOWN_INTERVAL]
    if step < 0 or interval == 0:
        return place
    if state[k, FRESH] and abs(place - expected) <= _JITTER:
        return place
    # Receive stamps may be late by more than half a wrap: prefer a place on which both counters agree. After a request
    # they must agree without a wrap of the alive counter: after a pause, or at another rate, they may do so by chance.
    known_bits = np.int64(-1) if state[k, FRESH] else table[k, MODULUS] - 1
    for near in range(_NEAR + 1):
        for side in (1, -1):
            moved = place + side * near * modulus - state[k, PLACE]
            if moved >= 0 and moved % interval == 0 and (moved // interval - step) & known_bits == 0:
                return place + side * near * modulus
    return place


@njit(cache=True, error_model="numpy")
def _lost(moved: np.int64, step: np.int64, k: np.int64, table: Int64, state: Int64) -> np.int64:
    """Return the frames missing before one whose counter moved by so many ticks."""
    interval = state[k, KNOWN_INTERVAL]
    if state[k, FRESH] and step != 0:
        return max(step - 1, _NOTHING)  # without an alive counter, a new beginning
    whole = interval > 0 and moved % interval == 0
    if step < 0:
        if moved <= interval or interval == 0 or moved == state[k, LAST_STEP]:
            return _NOTHING  # a shorter or a steady step is a new rate
        return moved // interval - 1 if whole else _UNKNOWN
    if whole and (moved // interval - step) & (table[k, MODULUS] - 1) == 0:
        return moved // interval - 1
    if step <= 1:
        return step - 1  # no frame is missing: a pause, or a new rate
    return _UNKNOWN


@njit(cache=True, error_model="numpy")
def _learn_interval(moved: np.int64, step: np.int64, k: np.int64, state: Int64) -> None:
    """Keep the ticks from frame to frame.

    They are known once two frames in a row, or the first two, are as far apart.
    """
    is_next = step == 1 or step < 0
    if is_next and (state[k, KNOWN_INTERVAL] == 0 or moved == state[k, LAST_STEP]):
        state[k, KNOWN_INTERVAL] = moved
    state[k, LAST_STEP] = moved if is_next else 0


@njit(cache=True, error_model="numpy")
def _by_stamp(
    stamp: np.int64, is_sent: bool, step: np.int64, k: np.int64, table: Int64, state: Int64, counts: Int64
) -> tuple[bool, np.int64, np.int64]:
    """Return whether a frame without a sample counter is new, and its time.

    The frames lost before it are returned, too.

    Whole wraps are told by the stamps, but for what this side sent itself: it was the sender that paused. Where the
    stamps leave no room for what the counter says, the loss is unknown.
    """
    if not state[k, SEEN]:
        return True, stamp, _NOTHING
    gap, cycle, modulus = stamp - state[k, STAMP], table[k, CYCLE], table[k, MODULUS]
    lost = _NOTHING
    if step >= 0:
        wraps = 0
        if cycle > 0 and not is_sent:
            wraps = max(0, (gap + cycle * (modulus // 2 - step)) // (cycle * modulus))
        lost = step + modulus * wraps - 1
        if lost < 0:
            return False, _NOTHING, _NOTHING
        if lost > 0 and cycle > 0 and not is_sent and 2 * gap < (2 * lost + 1) * cycle:
            lost = np.int64(_UNKNOWN)  # there was no time for so many: the counter jumped
    elif cycle > 0 and 2 * gap > 3 * cycle:
        lost = np.int64(_UNKNOWN)
    time = stamp
    if time <= state[k, TIME]:
        counts[k, BACKWARDS] += 1
        time = state[k, TIME] + 1  # times of one source rise strictly, whatever the stamps do
    return True, time, lost
