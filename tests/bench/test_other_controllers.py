"""Whole runs on controllers that are not the stock one: another DBC file, and stock ones with signals left out."""

import pytest
import yaml
from whole_run import files

from etb_hil.base.errors import InputError
from etb_hil.base.stock import find
from etb_hil.bench.job import JobFiles, execute, prepare
from etb_hil.bench.safe_state import bring_to_rest

DBC = """
VERSION ""
NS_ :
BS_:
BU_: Tester Ecu

BO_ 256 Target: 5 Tester
 SG_ State : 7|4@0+ (1,0) [0|15] "" Ecu
 SG_ Angle : 15|16@0- (0.01,0) [-300|300] "deg" Ecu
 SG_ Speed : 31|16@0- (0.1,0) [-3000|3000] "deg/s" Ecu

BO_ 258 Samples: 8 Ecu
 SG_ Count : 7|8@0+ (1,0) [0|255] "" Tester
 SG_ Current : 15|16@0- (1,0) [-32768|32767] "mA" Tester
 SG_ Encoder : 31|24@0- (0.01,0) [-80000|80000] "deg" Tester
 SG_ Plate : 55|16@0- (0.01,0) [-300|300] "deg" Tester
"""
DEG = 0.017453292519943295
ROLES = {
    "command_mode": "Target.State",
    "command_position": {"signal": "Target.Angle", "scale": DEG},
    "command_velocity": {"signal": "Target.Speed", "scale": DEG},
    "sample_counter": {"signal": "Samples.Count", "tick": "50 us"},
    "motor_current": {"signal": "Samples.Current", "scale": 1e-3},
    "motor_angle": {"signal": "Samples.Encoder", "scale": DEG, "wraps": True},
    "throttle_angle": {"signal": "Samples.Plate", "scale": DEG},
}


def stock_bench():
    return yaml.safe_load(find("bench", "virtual_classic").read_text())


def job_of(folder, bench, **names):
    (folder / "other.dbc").write_text(DBC)
    (folder / "bench.yaml").write_text(yaml.safe_dump(bench, sort_keys=False))
    stock = files(**names)
    return prepare(JobFiles(stock.scenario, folder / "bench.yaml", stock.model, stock.limits, stock.unit))


@pytest.mark.parametrize(("unit", "verdict"), [("default", "pass"), ("faulty", "fail")])
def test_another_dbc_serves_as_it_is(tmp_path, unit, verdict):
    """Neither enable, voltage, requests nor a status: what stands in no DBC is not asked of the controller."""
    bench = stock_bench() | {"dbc": "other.dbc", "roles": ROLES}
    finished = execute(job_of(tmp_path, bench, unit=unit), tmp_path / "out", "", 3)
    assert finished.results.unit.verdict == verdict
    assert finished.results.bench.safe_state is True
    assert "whether the controller says that the bridge is off" in " ".join(finished.results.bench.not_watched)


@pytest.mark.parametrize("without", [["motor_voltage"], ["command_voltage", "command_velocity", "command_enable"]])
def test_what_is_not_needed_is_gone_without(tmp_path, without):
    bench = stock_bench()
    for role in without:
        del bench["roles"][role]
    finished = execute(job_of(tmp_path, bench), tmp_path / "out", "", 3)
    assert finished.results.unit.verdict == "pass"


def test_what_is_needed_is_refused_with_the_bench_file_s_place(tmp_path):
    bench = stock_bench()
    del bench["roles"]["motor_angle"]
    with pytest.raises(InputError, match=r"bench\.yaml:\d+: roles\.motor_angle: no signal has the role"):
        job_of(tmp_path, bench)


@pytest.mark.parametrize("scale", [1e300, -1e300])
def test_a_drive_that_cannot_be_switched_on_or_off_is_refused(tmp_path, scale):
    bench = stock_bench()
    bench["roles"]["command_enable"] = {"signal": "EtbCommand.CommandEnable", "scale": scale}
    with pytest.raises(InputError, match=r"bench\.yaml:\d+: roles\.command_enable: .* the same for on and for off"):
        job_of(tmp_path, bench)


def test_a_set_point_that_the_signal_cannot_hold_is_refused_before_anything_moves(tmp_path):
    bench = stock_bench()
    bench["roles"]["command_position"] = {"signal": "EtbCommand.CommandPosition", "scale": 0.5}
    with pytest.raises(InputError, match=r"friction_check\.yaml:\d+: phases\[\d+\]: .*cannot hold this value"):
        job_of(tmp_path, bench)


def test_drive_off_is_commanded_until_patience_ends_whatever_fails():
    """Virtual time passes only while somebody sleeps: the way to the safe state must not wait for it for ever."""

    class Clock:
        now = 0

        def now_ns(self):
            return self.now

        def sleep_until_ns(self, until_ns):
            self.now = max(self.now, until_ns)

    class Tap:
        reports_enable = False
        current_zero = 0.0
        current_every_s = 0.0

        def command(self, _set_point):
            raise KeyError("a room that fails")

    clock = Clock()
    with pytest.raises(KeyError, match="a room that fails"):
        bring_to_rest(Tap(), clock, 10_000_000, commanding=True)
    assert 0.5e9 <= clock.now < 0.6e9
