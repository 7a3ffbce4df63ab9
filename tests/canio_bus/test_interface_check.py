"""What `etb-hil check` finds missing on a machine, and that every finding says how to put it right."""

import json
import os
import pty
import shutil
import subprocess

import pytest

from etb_hil.base.stock import find
from etb_hil.canio.bus import interface_check
from etb_hil.canio.bus.bus_settings import BusSettings
from etb_hil.canio.bus.interface_check import Finding, look_at
from etb_hil.canio.bus.interface_details import interface_details
from etb_hil.cli.main import main


@pytest.fixture
def network(tmp_path, monkeypatch):
    """Make interfaces as the kernel lists them; what `ip` says of them is `network.details`."""
    monkeypatch.setattr(interface_check, "_kernel_speaks_can", lambda: Finding(True, "the kernel speaks CAN"))

    def make(name, *, flags=0x1, mtu=16, kind=280, details=None):
        folder = tmp_path / name
        folder.mkdir()
        for file, text in (("type", kind), ("flags", hex(flags)), ("mtu", mtu)):
            (folder / file).write_text(f"{text}\n")
        monkeypatch.setattr(interface_check, "interface_details", lambda _: details)
        return tmp_path

    make.folder = tmp_path
    return make


def can(channel="can0", **settings):
    return BusSettings.model_validate({"interface": "socketcan", "channel": channel, **settings})


def missing(findings):
    assert all(finding.remedy for finding in findings if finding.ok is False)
    return [finding for finding in findings if finding.ok is False]


def test_a_missing_vcan_is_created_by_the_command_that_is_shown(network):
    network("can7")
    (found,) = missing(look_at(can("vcan0"), network.folder))
    assert found.what == "there is no interface vcan0; this machine has: can7"
    assert found.remedy.endswith("sudo ip link add dev vcan0 type vcan && sudo ip link set vcan0 up")


def test_an_interface_that_is_down_comes_up_with_the_benchs_bit_rates(network):
    folder = network("can0", flags=0x0, mtu=72, details={"state": "STOPPED"})
    (found,) = missing(look_at(can(bitrate="500 kbit/s", data_bitrate="2 Mbit/s", fd=True), folder))
    assert found.remedy == "sudo ip link set can0 up type can bitrate 500000 dbitrate 2000000 fd on"


def test_another_bit_rate_and_a_controller_that_is_off_the_bus(network):
    details = {"bittiming": {"bitrate": 250_000}, "state": "BUS-OFF"}
    rate, state = missing(look_at(can(bitrate="500 kbit/s"), network("can0", details=details)))
    assert "bit rate of 250000 bit/s, the bench file says 500000" in rate.what
    assert "bus-off" in state.what


def test_an_interface_as_the_bench_wants_it_lacks_nothing(network):
    details = {"bittiming": {"bitrate": 500_000}, "state": "ERROR-ACTIVE"}
    findings = look_at(can(bitrate="500 kbit/s"), network("can0", details=details))
    assert [finding.ok for finding in findings] == [True] * 4


def test_what_nobody_can_tell_is_unknown(network):
    findings = look_at(can(), network("can0", details=None))
    assert findings[-1].ok is None
    assert not missing(findings)


def test_frames_that_are_too_long_and_interfaces_that_are_none(network):
    folder = network("vcan0")
    (found,) = missing(look_at(can("vcan0", fd=True), folder))
    assert "mtu 72" in found.remedy
    network("eth0", kind=1)
    assert "must be a CAN interface" in missing(look_at(can("eth0"), folder))[0].what


def test_serial_ports_are_there_and_open_to_the_user(tmp_path, monkeypatch):
    def port(channel):
        return look_at(BusSettings(interface="slcan", channel=channel))[-1]

    assert port(str(tmp_path / "ttyACM9")).ok is False
    main_side, side = pty.openpty()
    assert port(f"{os.ttyname(side)}@115200").ok is True
    monkeypatch.setattr(interface_check.os, "access", lambda *_: False)
    assert port(os.ttyname(side)).remedy.startswith("sudo usermod -aG ")
    os.close(main_side), os.close(side)
    assert port("socket://adapter:29536").ok is None


def test_an_interface_that_python_can_does_not_know():
    (found,) = missing(look_at(BusSettings(interface="telepathy", channel="x")))
    assert "socketcan" in found.remedy


def test_ip_is_read_and_what_it_cannot_tell_is_none(tmp_path, monkeypatch):
    said = [{"linkinfo": {"info_data": {"state": "ERROR-ACTIVE", "bittiming": {"bitrate": 500000}}}}]
    command = tmp_path / "ip"
    command.write_text(f"#!/bin/sh\necho '{json.dumps(said)}'\n")
    command.chmod(0o755)
    monkeypatch.setattr(shutil, "which", lambda _: str(command))
    assert interface_details("can0")["bittiming"]["bitrate"] == 500_000
    for script in ("exit 1", "echo none of JSON", "echo '[]'", "echo '{}'", "echo '[7]'", "true"):
        command.write_text(f"#!/bin/sh\n{script}\n")
        assert interface_details("can0") is None


def test_an_ip_that_does_not_end_is_given_up(monkeypatch):
    def stuck(command, *, timeout, **_):
        raise subprocess.TimeoutExpired(command, timeout)

    monkeypatch.setattr(subprocess, "run", stuck)
    monkeypatch.setattr(shutil, "which", lambda *_, **__: "ip")
    assert interface_details("can0") is None


def test_another_data_bit_rate_is_found(network):
    details = {"bittiming": {"bitrate": 500_000}, "data_bittiming": {"bitrate": 4_000_000}, "state": "ERROR-ACTIVE"}
    wanted = can(bitrate="500 kbit/s", data_bitrate="2 Mbit/s", fd=True)
    (rate,) = missing(look_at(wanted, network("can0", mtu=72, details=details)))
    assert "data bit rate of 4000000 bit/s, the bench file says 2000000" in rate.what


def test_check_says_all_that_is_wrong_and_what_the_machine_lacks(tmp_path, capsys):
    bench, scenario = tmp_path / "b.yaml", tmp_path / "s.yaml"
    bench.write_text(
        "schema: etb_hil/bench/1\nname: b\nbus: {interface: socketcan, channel: vcan93}\ndbc: etb_controller\n"
        "roles: {motor_current: EtbCurrent.Wrong}\n"
        "limits: {current: 1 A, voltage: 1 V, angle: [0 deg, 90 deg], velocity: 1 rad/s, temperature: 90 degC,"
        " duration: 1 h}\n"
    )
    scenario.write_text("schema: etb_hil/scenario/1\nname: s\nphases: [{id: a, kind: of, duration: 1 s}]\n")
    assert main(["check", str(scenario), "--bench", str(bench)]) == 2
    said = capsys.readouterr().out
    assert "WRONG" in said
    assert "s.yaml:3" in said
    assert "b.yaml:5: roles.motor_current" in said
    assert "MISSING" in said


def test_check_of_good_files_on_a_machine_that_lacks_the_interface(tmp_path, capsys):
    bench = tmp_path / "b.yaml"
    bench.write_text(find("bench", "vcan_classic").read_text().replace("vcan0", "vcan93"))
    assert main(["check", "--bench", str(bench)]) == 3
    said = capsys.readouterr().out
    assert "vcan93 type vcan" in said or "modprobe can_raw" in said
    assert "not ready the files are good" in said
    assert main(["check"]) == 0
    assert "ready     nothing stands in the way" in capsys.readouterr().out
