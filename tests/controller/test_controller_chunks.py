"""The machine does the same whatever the sequence of calls by which time passes."""

import numpy as np
from controller_harness import MS, command, drive, model, request, stream
from hypothesis import given, settings
from hypothesis import strategies as st

from etb_hil.base.modes import Mode
from etb_hil.controller.machine import Machine

UNIT, NOMINAL = model("faulty"), model("default")
END = 0.3


def _rows():
    wave = stream(lambda t: command(Mode.POSITION, 0.5 + 0.2 * np.sin(20 * t), 4.0 * np.cos(20 * t)), 0.2, period_ms=5)
    asked = [(3 * MS, request()), (60 * MS + 17, request(burst=True, duration=0.1)), (250 * MS, request(rate=500.0))]
    return sorted(wave + asked, key=lambda row: row[0])


def _run(cuts=(), seed=4):
    return drive(Machine(UNIT, NOMINAL, seed=seed), _rows(), END, cuts)


WHOLE = _run()


@settings(max_examples=30)
@given(st.lists(st.floats(1e-6, END - 1e-6), max_size=40))
def test_cuts_change_nothing(cuts):
    cut = _run(cuts)
    for name in ("samples", "statuses", "switches"):
        assert getattr(cut, name).tobytes() == getattr(WHOLE, name).tobytes()


def test_a_call_for_every_tick_changes_nothing():
    cut = _run(np.arange(1, 6000) * 50e-6)
    assert cut.samples.tobytes() == WHOLE.samples.tobytes()
    assert cut.statuses.tobytes() == WHOLE.statuses.tobytes()


def test_the_same_seed_repeats_and_another_does_not():
    assert _run().samples.tobytes() == WHOLE.samples.tobytes()
    assert not np.array_equal(_run(seed=5).samples["current"], WHOLE.samples["current"])
