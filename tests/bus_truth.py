"""What every run says of its bus, whatever came of it; and what a run on which nobody laid a hand says besides."""

COUNTS = ("frames", "crc_failures", "counter_jumps", "repeated_counters")
FIGURES = ("load", "load_peak", "error_frames", "transmit_errors", "receive_errors", "dropped")
VIRTUAL = "etb_virtual"


def assert_bus_truth(results):
    """Each figure is there and can be true; what the driver cannot know is None, and the virtual bus knows all."""
    bus, bench = results.bus, results.bench
    figures = [getattr(bus, key) for key in FIGURES]
    assert all(figure is None or figure >= 0 for figure in figures), bus
    assert bus.state in {None, "error-active", "error-passive", "bus-off"}
    if bus.name.startswith(VIRTUAL) and results.duration_s > 0.3:  # else there was no whole window of load
        assert None not in figures, bus
        assert bus.state is not None
        assert bus.load <= bus.load_peak <= 1.0, bus
    for message in bus.messages:
        assert all(getattr(message, count) >= 0 for count in COUNTS), message
        assert message.lost is None or message.lost >= 0, message
    assert results.timestamp_grade in {"sample counter", "receive stamps"}
    for key in ("lateness", "frame_age"):
        assert 0.0 <= getattr(bench, key).mean_ms <= getattr(bench, key).worst_ms, (key, bench)
    for key, mean, worst in (("set_point_jitter", "rms_us", "worst_us"), ("answer_time", "mean_ms", "worst_ms")):
        spread = getattr(bench, key)
        assert spread is None or 0.0 <= getattr(spread, mean) <= getattr(spread, worst) * (1.0 + 1e-9), (key, spread)


def assert_bus_was_healthy(results):
    """Nothing was lost, spoilt or late on the virtual bus, and the set-points went out evenly."""
    bus, bench = results.bus, results.bench
    assert (bus.error_frames, bus.transmit_errors, bus.receive_errors, bus.dropped) == (0, 0, 0, 0)
    assert bus.state == "error-active"
    if results.duration_s > 0.3:
        assert 0.05 < bus.load_peak < 0.8
    for message in bus.messages:
        for fault in ("lost", "crc_failures", "counter_jumps", "repeated_counters"):
            assert getattr(message, fault) == 0, (message.name, fault)
    assert bench.lateness.worst_ms == 0.0  # virtual time
    assert bench.frame_age.worst_ms < (120.0 if bench.readings else 2.0), bench.frame_age  # ms: readings take turns
    if bench.set_point_jitter is not None:
        assert bench.set_point_jitter.worst_us < 500.0  # commands wait for a frame on the bus, or two
    if bench.answer_time is not None:
        assert bench.answer_time.worst_ms < 12.0  # a status comes every 10 ms
