"""Runs a stock scenario on a stock virtual bench, as several tests need it."""

from etb_hil.base.stock import find
from etb_hil.bench.job import JobFiles, execute, prepare


def files(**names):
    chosen = {"scenario": "friction_check", "bench": "virtual_classic", "model": "default", "limits": "default"}
    chosen |= {"unit": "default"} | names
    kinds = {"unit": "model"}
    return JobFiles(**{key: find(kinds.get(key, key), str(name)) for key, name in chosen.items()})


def run_on(folder, seed=3, serial="", **names):
    finished = execute(prepare(files(**names)), folder, serial, seed)
    assert_bus_was_healthy(finished)
    return finished


def assert_bus_was_healthy(finished):
    bus = finished.results["bus"]
    assert bus["error_frames"] == 0
    assert bus["state"] == "error-active"
    assert 0.05 < bus["load_peak"] < 0.8
    for message in bus["messages"]:
        assert message["frames"] > 0
        for fault in ("lost", "crc_failures", "counter_jumps", "repeated_counters"):
            assert message[fault] == 0, (message["name"], fault)
    assert (bus["transmit_errors"], bus["receive_errors"], bus["dropped"]) == (0, 0, 0)
    assert finished.results["timestamp_grade"] == "sample counter"
    bench = finished.results["bench"]
    assert bench["lateness"]["worst_ms"] == 0.0  # virtual time
    assert bench["frame_age"]["worst_ms"] < 2.0
    # A status comes every 10 ms; a run that switches nothing on is answered nothing.
    assert bench["answer_time"] is None or bench["answer_time"]["worst_ms"] < 12.0
    assert bench["set_point_jitter"]["worst_us"] < 500.0  # commands wait for a frame on the bus, or two
