"""A reading is late by more than its own changes last, by a delay or behind a lag: it is found and measured."""

from dataclasses import replace

import numpy as np
import pytest
from driven_plant import driven

from etb_hil.base.stock import find
from etb_hil.hypotheses.search import compared
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.parameters import load_model

MODEL = load_model(find("model", "default"))


@pytest.mark.parametrize("late", [3.3e-3, pytest.param(8.6e-3, marks=pytest.mark.study)])
def test_a_large_delay_of_the_current_is_the_likeliest_and_has_its_size(late):
    seen, _ = driven(MODEL, MODEL.vector(), 1000, late=late)
    best = compared(seen, MODEL).best
    assert best.ids == ("measurement_delay",)
    delay, lag = (best.fit.value(f"measurement_delay.{name}")[0] for name in ("delay", "lag"))
    assert delay + lag == pytest.approx(late, abs=0.2e-3)


@pytest.mark.parametrize(
    ("id_", "delay", "lag"),
    [
        ("plate_angle_delay", 0.0, 2.2e-3),
        *(
            pytest.param(*one, marks=pytest.mark.study)
            for one in (
                ("measurement_delay", 0.0, 2.2e-3),
                ("measurement_delay", 0.0, 6e-3),
                ("angle_delay", 1.4e-3, 0.0),
                ("angle_delay", 3.3e-3, 0.0),
                ("angle_delay", 0.0, 2.2e-3),
                ("motor_angle_delay", 1.3e-3, 6e-3),
                ("plate_angle_delay", 0.1e-3, 0.0),
            )
        ),
    ],
)
def test_of_each_channel_delay_and_lag_are_found(id_, delay, lag):
    """Only another channel of angles may be as likely a shape; of a short lag and a delay, the sum counts."""
    p = MODEL.vector()
    p[list(CATALOGUE[id_].indices)] = delay, lag
    seen, _ = driven(MODEL, p, 1000)
    step = compared(seen, MODEL)
    assert step.best.ids == (id_,)
    assert {one_id for one in step.group for one_id in one.ids} <= {"angle_delay"} - {id_}
    found_delay, found_lag = (step.best.fit.value(f"{id_}.{name}")[0] for name in ("delay", "lag"))
    if lag > 0.0:
        assert found_lag == pytest.approx(lag, rel=0.03)
        assert found_delay == pytest.approx(delay, abs=0.15e-3)
    assert found_delay + found_lag == pytest.approx(delay + lag, abs=0.1e-3)


@pytest.mark.parametrize(
    ("id_", "unread"), [pytest.param("motor_angle_delay", 2, marks=pytest.mark.study), ("plate_angle_delay", 1)]
)
def test_where_one_angle_was_read_it_is_that_one_or_all(id_, unread):
    p = MODEL.vector()
    p[CATALOGUE[id_].indices[0]] = 3.3e-3
    seen, _ = driven(MODEL, p, 1000)
    readings = seen.readings.copy()
    readings[:, unread] = np.nan
    step = compared(replace(seen, readings=readings), MODEL, ids=["angle_delay", id_])
    assert {one_id for one in (step.best, *step.group) for one_id in one.ids} == {"angle_delay", id_}
