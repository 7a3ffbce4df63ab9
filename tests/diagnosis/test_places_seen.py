"""The way that was slid over slowly, and what of it was not: also where the model's stops are not the unit's."""

from dataclasses import replace

import numpy as np
import pytest
from whole_run import run_on

from etb_hil.base.outcome import UnitVerdict
from etb_hil.base.stock import find
from etb_hil.diagnosis.limits_file import load_limits
from etb_hil.diagnosis.local_friction import CELL, LocalFriction
from etb_hil.diagnosis.places_seen import too_wide_unseen
from etb_hil.plant.parameters import load_model
from etb_hil.replays.session_replay import judged_under

MODEL = load_model(find("model", "default"))
STOPS = MODEL.values.stop_low, MODEL.values.stop_high


def seen(low, high):
    angle = np.arange(low, high, CELL)
    return LocalFriction(angle, *np.zeros((3, len(angle))))


def with_stops(low, high):
    known = MODEL.parameters
    stops = {"stop_low": replace(known["stop_low"], value=low), "stop_high": replace(known["stop_high"], value=high)}
    return replace(MODEL, parameters={**known, **stops})


def unseen(local, model, reached):
    return too_wide_unseen(local, model, model.values, reached)


def test_of_a_way_that_was_slid_over_nothing_is_unseen():
    assert unseen(seen(0.03, 1.45), MODEL, STOPS) is None
    assert unseen(seen(0.03, 1.45), MODEL, (-0.02, 1.5)) is None  # stops give way
    assert unseen(None, MODEL, STOPS) is None


def test_the_widest_segment_is_said():
    found = unseen(seen(0.03, 1.0), MODEL, STOPS)
    assert (found.start, found.end) == (pytest.approx(1.0, abs=CELL), pytest.approx(STOPS[1], abs=CELL))
    assert found.share == pytest.approx(0.33, abs=0.02)
    assert found.stop is None


@pytest.mark.parametrize(
    ("stops", "local", "stop"), [((0.0, 1.0), (0.03, 0.98), 1.0), ((0.3, 1.484), (0.33, 1.45), 0.3)]
)
def test_a_way_beyond_the_stops_of_the_model_counts(stops, local, stop):
    model = with_stops(*stops)
    assert unseen(seen(*local), model, stops) is None
    found = unseen(seen(*local), model, STOPS)
    assert found.stop == stop
    assert found.share > 0.15


@pytest.mark.parametrize(("high", "verdict"), [(1.484, UnitVerdict.PASS), (1.0, UnitVerdict.INCONCLUSIVE)])
def test_no_unit_passes_by_the_part_of_its_way_that_the_model_has(tmp_path, high, verdict):
    session = run_on(tmp_path, unit="default").session
    limits = load_limits(find("limits", "default"))
    result = judged_under(session.folder, with_stops(0.0, high), limits)
    assert result.verdict is verdict
    said = [reason.text for reason in result.reasons if reason.id == "places_not_seen"]
    assert [text.endswith("the model's stop at 57.3 deg, beyond which nothing is judged") for text in said] == (
        [] if verdict is UnitVerdict.PASS else [True]
    )
