"""Faults of the controller itself, as nodes between it and the bus, and a node that babbles.

Each takes the node it spoils and is a node again, so that they can be put into one another.
"""

from dataclasses import replace

import numpy as np

from etb_hil.canio.dbc.codec import MessageCodec
from etb_hil.canio.dbc.commands import CommandEncoder
from etb_hil.canio.dbc.protection import alive_counter, protect_at
from etb_hil.canio.dbc.signal_bits import Overflow
from etb_hil.canio.frames import FrameBlock, FrameFlag, concatenate_frames

MS = 1_000_000


class Resetting:
    """Loses its power at `at_ns` and is back `boot_ns` later; with `resumes`, it goes on sending what it was asked."""

    def __init__(self, make, dialect, at_ns, boot_ns, *, resumes):
        self._make, self._at, self._boot, self._resumes = make, at_ns, boot_ns, resumes
        self._node = make(0)
        self._requests = {m.ident for m in dialect.messages if "request_rate" in m.roles}
        self._last = None
        self._is_back = False

    def run(self, until_ns, inbox):
        for index in range(len(inbox)):
            if int(inbox.ident[index]) in self._requests:
                self._last = inbox.select(slice(index, index + 1))
        if until_ns < self._at:
            return self._node.run(until_ns, inbox)
        back = self._at + self._boot
        if not self._is_back:
            out = self._node.run(self._at, inbox.select(inbox.stamp_ns < self._at)) if self._node else None
            self._node = None
            if until_ns <= back:
                return out if out is not None else inbox.select(slice(0))
            self._node, self._is_back = self._make(back), True
            inbox = inbox.select(inbox.stamp_ns >= back)
            if self._resumes and self._last is not None:
                inbox = concatenate_frames([replace(self._last, stamp_ns=np.array([back], np.int64)), inbox])
            later = self._node.run(until_ns, inbox)
            return later if out is None else concatenate_frames([out, later])
        return self._node.run(until_ns, inbox)


class OwnClock:
    """A controller whose crystal is off by `drift`, and which stands still for `hang_ns` at `at_ns`."""

    def __init__(self, node, *, drift=0.0, at_ns=1 << 62, hang_ns=0):
        self._node, self._rate, self._at, self._hang = node, 1.0 + drift, at_ns, hang_ns
        self._until = 0

    def _local(self, t):
        t = np.asarray(t, np.int64)
        passed = np.where(t < self._at, t, np.where(t < self._at + self._hang, self._at, t - self._hang))
        return np.floor(passed * self._rate).astype(np.int64)

    def run(self, until_ns, inbox):
        frames = self._node.run(int(self._local(until_ns)), replace(inbox, stamp_ns=self._local(inbox.stamp_ns)))
        passed = np.ceil(frames.stamp_ns / self._rate).astype(np.int64)
        stamps = np.where(passed < self._at, passed, passed + self._hang)
        frames = replace(frames, stamp_ns=np.clip(stamps, self._until, until_ns))
        self._until = until_ns
        return frames


class Late:
    """A controller that sends everything `delay_ns` late from `at_ns` on."""

    def __init__(self, node, at_ns, delay_ns):
        self._node, self._at, self._delay = node, at_ns, delay_ns
        self._waiting = None
        self._until = 0

    def run(self, until_ns, inbox):
        frames = self._node.run(until_ns, inbox)
        late = frames.stamp_ns + np.where(frames.stamp_ns >= self._at, self._delay, 0)
        frames = replace(frames, stamp_ns=late)
        if self._waiting is not None and len(self._waiting):
            frames = concatenate_frames([self._waiting, frames])
        due = frames.stamp_ns <= until_ns
        self._waiting = frames.select(~due)
        return frames.select(due)


class Deaf:
    """A controller that neither hears nor sends from `at_ns` on for `for_ns`, while it lives on."""

    def __init__(self, node, at_ns, for_ns):
        self._node, self._from, self._until = node, at_ns, at_ns + for_ns

    def run(self, until_ns, inbox):
        frames = self._node.run(until_ns, inbox.select(self._heard(inbox)))
        return frames.select(self._heard(frames))

    def _heard(self, frames):
        return (frames.stamp_ns < self._from) | (frames.stamp_ns >= self._until)


class Rewriting:
    """A controller that means something else than it sends, or hears something else than it was sent.

    `change(role, values, stamp_ns)` returns the values (n, samples) that go out in place of a role's, or None; what it
    does to `sample_counter` and `turns` (of a role that counts turns) counts too. CRC and alive counter stay right.
    """

    def __init__(self, node, dialect, at_ns, until_ns, change, *, heard=False):
        self._node, self._from, self._until, self._change, self._heard = node, at_ns, until_ns, change, heard
        self._messages = [(m, MessageCodec(m.message)) for m in dialect.messages if m.commanded is heard]

    def run(self, until_ns, inbox):
        if self._heard:
            return self._node.run(until_ns, self._rewritten(inbox))
        return self._rewritten(self._node.run(until_ns, inbox))

    def _rewritten(self, frames):
        struck = (frames.stamp_ns >= self._from) & (frames.stamp_ns < self._until)
        if not struck.any():
            return frames
        data = frames.data.copy()
        for message, codec in self._messages:
            rows = np.flatnonzero(struck & (frames.ident == message.ident))
            if len(rows):
                self._rewrite(message, codec, data, rows, frames.stamp_ns[rows])
        return replace(frames, data=data)

    def _rewrite(self, message, codec, data, rows, stamp_ns):
        values = codec.decode(data[rows])
        changed = False
        targets = [(column.role, column.signals) for column in message.columns]
        targets += [("turns", (column.turns,)) for column in message.columns if column.turns]
        targets += [("sample_counter", (message.counter.signal,))] if message.counter else []
        for role, signals in targets:
            new = self._change(role, np.stack([values[name] for name in signals], axis=1), stamp_ns)
            if new is not None:
                values |= {name: new[:, k] for k, name in enumerate(signals)}
                changed = True
        if not changed:
            return
        profile, ids = int(message.protection.profile), message.protection.id_table()
        counters = [int(alive_counter(data[row], profile)) for row in rows] if profile else [0] * len(rows)
        data[rows, : message.length] = codec.encode(values, Overflow.WRAP)
        for row, counter in zip(rows, counters, strict=True):
            protect_at(data[row], 0, message.length, profile, ids, counter)


class Babbler:
    """Sends frames of one id in a steady stream inside its window."""

    def __init__(self, from_ns, until_ns, ident, period_ns):
        self._next, self._until, self._ident, self._period = from_ns, until_ns, ident, period_ns

    def run(self, until_ns, inbox):
        last = min(until_ns, self._until)
        stamps = np.arange(self._next, last + 1, self._period, dtype=np.int64)
        if len(stamps):
            self._next = int(stamps[-1]) + self._period
        n = len(stamps)
        return FrameBlock(
            stamps,
            np.full(n, self._ident, np.uint32),
            np.full(n, int(FrameFlag(0)), np.uint8),
            np.full(n, 8, np.uint8),
            np.zeros((n, inbox.data.shape[1]), np.uint8),
            np.zeros(n, np.uint8),
        )


class OtherBench:
    """A second bench that commands the controller every 10 ms inside its window, with counters of its own."""

    def __init__(self, dialect, from_ns, until_ns, *, enable, position):
        self._encoder, self._next, self._until = CommandEncoder(dialect), from_ns, until_ns
        self._command = {"command_mode": float(enable), "command_enable": float(enable), "command_position": position}

    def run(self, until_ns, inbox):
        frames = [inbox.select(slice(0))]
        while self._next <= min(until_ns, self._until):
            sent = self._encoder.encode(self._command, self._next)
            frames.append(replace(sent, flags=sent.flags & ~np.uint8(FrameFlag.SENT)))
            self._next += 10 * MS
        return concatenate_frames(frames)


class ShiftedStamps:
    """A link whose stamps are off by `offset_ns` from `at_ns` on: the host's clock was set."""

    def __init__(self, link, at_ns, offset_ns):
        self._link, self._at, self._offset = link, at_ns, offset_ns

    def __getattr__(self, name):
        return getattr(self._link, name)

    def receive(self):
        frames = self._link.receive()
        return replace(frames, stamp_ns=frames.stamp_ns + np.where(frames.stamp_ns >= self._at, self._offset, 0))


class SetBackStamps:
    """A link whose clock runs ahead and is set back by `step_ns`, every `every_ns`."""

    def __init__(self, link, step_ns, every_ns):
        self._link, self._step, self._every = link, step_ns, every_ns

    def __getattr__(self, name):
        return getattr(self._link, name)

    def receive(self):
        frames = self._link.receive()
        return replace(frames, stamp_ns=frames.stamp_ns + frames.stamp_ns % self._every * self._step // self._every)
