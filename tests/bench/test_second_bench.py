"""More than one bench: after another one on a controller, and beside another one on a bus."""

from whole_run import BRISK, files

from etb_hil.base.stock import find
from etb_hil.bench import job as job_room
from etb_hil.bench.job import execute, prepare
from etb_hil.canio.bus.link import VirtualLink
from etb_hil.canio.bus.virtual_network import VirtualNetwork
from etb_hil.controller.virtual_controller import VirtualController


def test_the_next_bench_on_a_running_controller_starts_well(tmp_path, monkeypatch):
    job = prepare(files(scenario="paper_step"))
    bus = job.setup.bench.bus
    network = VirtualNetwork(int(bus.bitrate), int(bus.data_bitrate), fd=bus.fd)
    network.attach(VirtualController(job.unit, job.setup.dialect, 1, nominal=job.model))
    monkeypatch.setattr(job_room, "connect", lambda _job, _seed: (VirtualLink(network), network.clock))
    first = execute(job, tmp_path, "", 1)
    second = execute(job, tmp_path, "", 1)
    assert first.results.bench.outcome == "ok"
    assert second.results.bench.outcome == "ok"
    status = second.analysis.recording.series("faults").values
    assert status.max() > 0  # it did refuse the first frames, and said so
    assert status[50:].max() == 0


def test_two_units_on_one_bus_are_told_apart_by_their_id_offset(tmp_path, monkeypatch):
    brisk, offset = tmp_path / "brisk.yaml", tmp_path / "offset.yaml"
    brisk.write_text(BRISK)
    offset.write_text(find("bench", "virtual_classic").read_text() + "id_offset: 0x100\n")
    healthy, faulty = files(scenario=brisk, unit="default"), files(scenario=brisk, bench=offset, unit="faulty")
    jobs = {"pass": prepare(healthy), "fail": prepare(faulty)}
    for verdict, job in jobs.items():
        bus = job.setup.bench.bus
        network = VirtualNetwork(int(bus.bitrate), int(bus.data_bitrate), fd=bus.fd)
        for other in jobs.values():
            network.attach(VirtualController(other.unit, other.setup.dialect, 1, nominal=other.model))
        monkeypatch.setattr(job_room, "connect", lambda _job, _seed, n=network: (VirtualLink(n), n.clock))
        finished = execute(job, tmp_path, "", 1)
        assert finished.results.unit.verdict == verdict
        assert not any(message.lost or message.crc_failures for message in finished.results.bus.messages)
