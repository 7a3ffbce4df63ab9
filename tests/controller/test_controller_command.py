"""`etb-hil controller` refuses what it cannot do, in words, before anything is on a bus."""

import pytest

from etb_hil.base.outcome import ExitCode
from etb_hil.cli.main import main


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--bench", "virtual_classic"], "--interface and --channel"),
        (["--unit", "no such unit"], "no model file 'no such unit'"),
        (["--nominal", "no such unit"], "no model file 'no such unit'"),
        (["--bench", "no such bench"], "no bench file"),
        (["--bench", "vcan_classic", "--fd"], "has no CAN FD"),
        (["--start-angle", "8"], "--start-angle: the unit is missing"),
        (["--ambient", "20 V"], "--ambient: must be a unit of temperature (got 'V')"),
        (["--law", "bang-bang"], "pd, pid, sliding-mode"),
        (["--log", "/nonexistent/folder/log.jsonl"], "cannot be written"),
        (["--interface", "no_such_interface"], "no_such_interface"),
    ],
)
def test_bad_input_is_refused_with_what_to_do(options, words, capsys):
    assert main(["controller", *options]) == ExitCode.BAD_INPUT
    assert words in capsys.readouterr().err


def test_a_bus_that_is_not_there_is_a_bench_fault(capsys):
    assert main(["controller", "--channel", "nocan7"]) == ExitCode.BENCH_FAULT
    error = capsys.readouterr().err
    assert "nocan7" in error or "SocketCAN" in error
