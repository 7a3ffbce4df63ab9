"""The room on the bus, summed in worst-case bits before anything moves.

The sum is over what is going to be sent.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.canio.bit_timing import worst_case_bits

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping

    from etb_hil.canio.dbc.dialect import Dialect
    from etb_hil.canio.dbc.dialect_message import DialectMessage

# Share of the bus. Frames of random arrival wait for rho / (2 (1 - rho)) others on average (Pollaczek and Khinchine):
# two at 0.8, and without bound towards 1.
LIMIT = 0.8

_SIGNALS = {"current": ("motor_current", "motor_voltage"), "encoder": ("motor_angle", "throttle_angle")}


class BusRates(Protocol):
    """What the budget needs of a bus.

    Bit rates in bit/s, and whether FD frames may be sent.
    """

    @property
    def bitrate(self) -> float:
        """Nominal bit rate."""
        ...

    @property
    def data_bitrate(self) -> float:
        """Bit rate behind the bit rate switch of FD frames."""
        ...

    @property
    def fd(self) -> bool:
        """Whether the bus takes FD frames."""
        ...


@dataclass(frozen=True, slots=True)
class BudgetLine:
    """One message's part of the bus's time (0 to 1).

    A part has frames a second, and worst-case bits at both rates.
    """

    message: str
    rate: float
    nominal_bits: int
    data_bits: int
    share: float

    def __str__(self) -> str:
        bits = f"{self.nominal_bits} bits" + (f" + {self.data_bits} fast bits" if self.data_bits else "")
        return f"{self.message} {self.rate:g}/s x {bits} = {self.share:.1%}"


@dataclass(frozen=True, slots=True)
class BusBudget:
    """The sum, with a line for each message."""

    lines: tuple[BudgetLine, ...]
    limit: float

    @property
    def share(self) -> float:
        """Share of the bus's time that all messages take together in the worst case."""
        return sum(line.share for line in self.lines)

    def __str__(self) -> str:
        return " + ".join(map(str, self.lines)) + f"; together {self.share:.1%}"


def bus_budget(
    dialect: Dialect,
    bus: BusRates,
    *,
    command_rate: float,
    signals: Collection[str],
    sample_rate: float,
    burst: bool,
    limit: float = LIMIT,
) -> BusBudget:
    """Return what commands (Hz), cyclic messages and a measurement put on the bus.

    `signals` holds "current", "encoder" or both; `sample_rate` is in Hz and means nothing in bursts, which come at the
    sample counter's own rate. Raises InputError with the sum where it is more than `limit` of the bus, where the bus
    takes no FD frames that are needed, or where no message brings what is asked for.
    """
    rates: dict[str, float] = {}
    for message in dialect.messages:
        if "command_mode" in message.roles or "command_position" in message.roles:
            rates[message.name] = command_rate
        elif message.counter is not None:
            if _brings(message, signals) and (message.samples > 1) == burst:
                if not burst:
                    _require_a_count_a_sample(dialect, message.name, message.counter.tick_ns, sample_rate)
                rates[message.name] = 1e9 / (message.counter.tick_ns * message.samples) if burst else sample_rate
        elif message.cycle_ns:
            rates[message.name] = 1e9 / message.cycle_ns
    cyclic = [signal for signal in signals if not any(dialect.is_requested(role) for role in _SIGNALS[signal])]
    _require_measurement(dialect, rates, cyclic, burst)
    return budget_of(dialect, rates, bus, limit)


def budget_of(dialect: Dialect, rates: Mapping[str, float], bus: BusRates, limit: float = LIMIT) -> BusBudget:
    """Return the budget of messages sent at the given rates (name -> Hz).

    Raises InputError as `bus_budget` does.
    """
    lines = []
    for name, rate in rates.items():
        message = dialect.message(name)
        if message.fd and not bus.fd:
            raise InputError(
                Problem(
                    f"{name} is an FD frame, and the bus takes none",
                    Place(dialect.path),
                    remedy="switch FD on in the bench's bus, or use a DBC file of classic frames",
                )
            )
        nominal, data = worst_case_bits(
            message.length, extended=message.extended, fd=message.fd, bitrate_switch=message.bitrate_switch
        )
        share = rate * (nominal / bus.bitrate + data / bus.data_bitrate)
        lines.append(BudgetLine(name, rate, nominal, data, share))
    lines += _requested(dialect, bus)
    budget = BusBudget(tuple(lines), limit)
    if budget.share > limit:
        raise InputError(
            Problem(
                f"the bus cannot carry this: {budget}",
                allowed=f"up to {limit:.0%} of {_speed(bus)}",
                remedy="ask for fewer samples a second, or use a faster bus",
            )
        )
    return budget


def _requested(dialect: Dialect, bus: BusRates) -> Iterator[BudgetLine]:
    """Yield what roles that are read by data identifier put on the bus.

    A role is a frame each way, or one by itself.
    """
    if dialect.requested is None:
        return
    bits, _ = worst_case_bits(8, extended=dialect.requested.extended, fd=False, bitrate_switch=False)
    for one in dialect.requested.identifiers:
        rate = 1e9 / one.every_ns * (1 if one.rate else 2)
        yield BudgetLine(one.source, rate, bits, 0, rate * bits / bus.bitrate)


def _brings(message: DialectMessage, signals: Collection[str]) -> bool:
    return any(role in message.roles for signal in signals for role in _SIGNALS[signal])


def _require_measurement(dialect: Dialect, rates: Mapping[str, float], signals: Collection[str], burst: bool) -> None:
    asked = [dialect.message(name) for name in rates]
    for signal in signals:
        if not any(message.counter is not None and _brings(message, [signal]) for message in asked):
            what = "bursts" if burst else "single samples"
            uncounted = [m.name for m in dialect.messages if m.counter is None and _brings(m, [signal])]
            if uncounted:
                raise InputError(
                    Problem(
                        f"{uncounted[0]} brings the {signal} without a sample counter: current and angle cannot be put "
                        "on one clock",
                        Place(dialect.path, key=uncounted[0]),
                        remedy="map the role 'sample_counter' of this message",
                    )
                )
            raise InputError(
                Problem(
                    f"no message brings {what} of the {signal}",
                    Place(dialect.path),
                    remedy=f"ask for {'single samples' if burst else 'bursts'}, or map the roles of such a message",
                )
            )


def _require_a_count_a_sample(dialect: Dialect, name: str, tick_ns: int, sample_rate: float) -> None:
    """Raise InputError where samples come faster than their counter counts.

    Two would have one number.
    """
    if sample_rate * tick_ns > 1e9:
        raise InputError(
            Problem(
                "samples come faster than the sample counter counts",
                Place(dialect.path, key=name),
                f"{sample_rate:g} Hz",
                f"up to {1e9 / tick_ns:g} Hz, one a tick of {tick_ns * 1e-6:g} ms",
                "lower the rate of 'measure', or correct the counter's tick in the bench file",
            )
        )


def _speed(bus: BusRates) -> str:
    nominal = f"{bus.bitrate / 1e3:g} kbit/s"
    return nominal + (f" and {bus.data_bitrate / 1e3:g} kbit/s" if bus.fd else "")
