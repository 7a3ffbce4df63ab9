"""A current is read late by more than its own changes last, by a delay or behind a lag: it is found and measured."""

import pytest
from driven_plant import driven

from etb_hil.base.stock import find
from etb_hil.hypotheses.search import compared
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.parameters import load_model

MODEL = load_model(find("model", "default"))


@pytest.mark.parametrize("late", [3.3e-3, 8.6e-3])
def test_a_large_delay_is_the_likeliest_and_has_its_size(late):
    seen, _ = driven(MODEL, MODEL.vector(), 1000, late=late)
    best = compared(seen, MODEL).best
    assert best.ids == ("measurement_delay",)
    delay, lag = (best.fit.value(f"measurement_delay.{name}")[0] for name in ("delay", "lag"))
    assert delay + lag == pytest.approx(late, abs=0.2e-3)


@pytest.mark.parametrize("lag", [2.2e-3, 6e-3])
def test_a_large_lag_is_no_delay(lag):
    p = MODEL.vector()
    p[CATALOGUE["measurement_delay"].indices[1]] = lag
    seen, _ = driven(MODEL, p, 1000)
    best = compared(seen, MODEL).best
    assert best.ids == ("measurement_delay",)
    assert best.fit.value("measurement_delay.lag")[0] == pytest.approx(lag, rel=0.03)
    assert best.fit.value("measurement_delay.delay")[0] == pytest.approx(0.0, abs=0.15e-3)
