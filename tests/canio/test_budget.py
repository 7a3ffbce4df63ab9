"""The bus budget: sums worked by hand, and refusals that show them."""

from types import SimpleNamespace

import dialects
import pytest

from etb_hil.base.errors import InputError
from etb_hil.canio.bus.budget import budget_of, bus_budget

CLASSIC = SimpleNamespace(bitrate=500e3, data_bitrate=2e6, fd=False)
FD = SimpleNamespace(bitrate=500e3, data_bitrate=2e6, fd=True)


def ask(dialect, bus, **changes):
    asked = {"command_rate": 200.0, "signals": ("current", "encoder"), "sample_rate": 1000.0, "burst": False}
    return bus_budget(dialect, bus, **{**asked, **changes})


def test_the_classic_kilohertz_is_summed():
    budget = ask(dialects.classic(), CLASSIC)
    # 8 bytes are 135 bits at most: 200 commands, 1000 + 1000 measurements, 100 status frames a second.
    assert {line.message: line.rate for line in budget.lines} == {
        "EtbCommand": 200.0,
        "EtbCurrent": 1000.0,
        "EtbEncoder": 1000.0,
        "EtbStatus": 100.0,
    }
    assert budget.share == pytest.approx(2300 * 135 / 500e3)


def test_fd_bursts_fit_at_two_megabits():
    budget = ask(dialects.fd(), FD, burst=True)
    burst = next(line for line in budget.lines if line.message == "EtbBurst")
    assert burst.rate == 2000.0
    # 17 + 3 stuff bits + 12 at the nominal rate; 5 + 384 + 97 stuff bits + 32 + 1 at the data rate.
    assert (burst.nominal_bits, burst.data_bits) == (32, 519)
    assert budget.share < 0.8


def test_too_much_is_refused_with_the_sum():
    with pytest.raises(InputError, match=r"EtbCurrent 2000/s x 135 bits = 54.0%.*together.*up to 80% of 500 kbit/s"):
        ask(dialects.classic(), CLASSIC, sample_rate=2000.0)
    assert ask(dialects.classic(), SimpleNamespace(bitrate=1e6, data_bitrate=2e6, fd=False), sample_rate=2000.0)


def test_the_limit_is_a_parameter():
    assert ask(dialects.classic(), CLASSIC, limit=0.65)
    with pytest.raises(InputError, match="up to 60%"):
        ask(dialects.classic(), CLASSIC, limit=0.6)


def test_fd_frames_need_an_fd_bus():
    with pytest.raises(InputError, match="the bus takes none"):
        ask(dialects.fd(), CLASSIC, burst=True)


def test_what_no_message_brings_is_refused():
    with pytest.raises(InputError, match="no message brings bursts of the current"):
        ask(dialects.classic(), CLASSIC, burst=True)
    with pytest.raises(InputError, match="no message brings single samples"):
        ask(dialects.fd(), FD)


def test_one_signal_alone_leaves_the_other_message_out():
    assert "EtbEncoder" not in {line.message for line in ask(dialects.classic(), CLASSIC, signals=("current",)).lines}


def test_rates_of_any_messages():
    budget = budget_of(dialects.classic(), {"EtbStatus": 10.0}, CLASSIC)
    assert str(budget) == "EtbStatus 10/s x 135 bits = 0.3%; together 0.3%"


def test_samples_that_come_faster_than_they_are_counted_are_refused():
    assert ask(dialects.classic(), SimpleNamespace(bitrate=10e6, data_bitrate=2e6, fd=False), sample_rate=20e3)
    with pytest.raises(InputError, match=r"samples come faster than the sample counter counts.*up to 20000 Hz"):
        ask(dialects.classic(), SimpleNamespace(bitrate=100e6, data_bitrate=2e6, fd=False), sample_rate=40e3)
