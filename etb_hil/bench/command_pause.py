"""The longest recent pause between two commands, for a watchdog's trip."""

from __future__ import annotations

KEPT_NS = 500_000_000  # a status tells of the watchdog long before
LATE_TICKS = 2  # a pause of more than this many intervals is this host's doing


class CommandPause:
    """Notes when commands were sent, `tick_ns` apart where the host is in time."""

    def __init__(self, tick_ns: int) -> None:
        self._tick_ns = tick_ns
        self._sent_ns: int | None = None
        self._longest_ns = self._ended_ns = 0

    def note(self, sent_ns: int) -> None:
        """Take that a command has just been sent."""
        pause_ns = self._since_sent(sent_ns)
        if pause_ns >= self._longest_ns or sent_ns - self._ended_ns > KEPT_NS:
            self._longest_ns, self._ended_ns = pause_ns, sent_ns
        self._sent_ns = sent_ns

    def rest(self) -> None:
        """Take that no command is sent from now on, on purpose."""
        self._sent_ns = None

    def too_long(self, now_ns: int) -> str | None:
        """Return in words how long no command was sent, if it trips a watchdog.

        The pause is that until now, or before a command.
        """
        longest_ns = max(self._longest_ns, self._since_sent(now_ns))
        if longest_ns <= LATE_TICKS * self._tick_ns:
            return None
        due, came = self._tick_ns * 1e-6, longest_ns * 1e-6
        return f"{came:.0f} ms passed without a command; one was due every {due:.0f} ms"

    def _since_sent(self, now_ns: int) -> int:
        return 0 if self._sent_ns is None else now_ns - self._sent_ns
