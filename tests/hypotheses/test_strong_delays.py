"""A current that is read late by more than its own changes last is found, though no slope leads there."""

import pytest
from driven_plant import driven

from etb_hil.base.stock import find
from etb_hil.hypotheses.search import compared
from etb_hil.plant.parameters import load_model

MODEL = load_model(find("model", "default"))


@pytest.mark.parametrize("late", [3.3e-3, 8.6e-3])
def test_a_large_delay_is_the_likeliest_and_has_its_size(late):
    seen, _ = driven(MODEL, MODEL.vector(), 1000, late=late)
    best = compared(seen, MODEL).best
    assert best.ids == ("measurement_delay",)
    delay, lag = (best.fit.value(f"measurement_delay.{name}")[0] for name in ("delay", "lag"))
    assert delay + lag == pytest.approx(late, abs=0.2e-3)
