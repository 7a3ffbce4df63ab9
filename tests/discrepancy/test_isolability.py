"""A motion that was designed to tell effects apart does so; a textbook sweep does not."""

import pytest
from synthetic import MODEL, measurement, swept, textbook

from etb_hil.discrepancy.balances import Balances
from etb_hil.discrepancy.isolability import isolability, sensitivities, together


@pytest.fixture(scope="module")
def parts():
    return [
        sensitivities(MODEL, [Balances(measurement(MODEL.vector(), 1, angle), MODEL)])
        for angle in (textbook(), swept())
    ]


@pytest.mark.slow
def test_a_textbook_sweep_leaves_more_open(parts):
    slow, designed = (isolability(part) for part in parts)
    assert len(designed.hidden) < len(slow.hidden)
    resolved = [found.pairs - len(found.alike) for found in (slow, designed)]
    assert len(designed.alike) <= 10
    assert resolved[1] > 1.5 * resolved[0]


@pytest.mark.slow
def test_another_record_never_hides_what_the_first_one_shows(parts):
    both, one = isolability(together(parts)), isolability(parts[1])
    assert set(both.hidden) <= set(one.hidden)


@pytest.mark.slow
def test_brush_drop_and_dead_time_cannot_be_told_apart_by_motion(parts):
    alike = {frozenset(pair[:2]) for pair in isolability(parts[1]).alike}
    assert frozenset({"brush_drop", "hbridge_dead_time"}) in alike
