"""A cause found first may have stood in for two: beside the second it is asked again."""

import pytest
from explain_cases import hidden_case
from explain_study import searched

from etb_hil.discrepancy.search.reconsideration import reconsider

HIDDEN = ("friction_load", "friction_temperature")


@pytest.fixture(scope="module")
def two_hidden():
    """A record in which friction of the load and of the temperature look, at first, like presliding memory."""
    return hidden_case(60056, HIDDEN, "strong", pair=True)


def _causes(findings):
    return {found.winner.id for found in findings.accepted}


@pytest.mark.study
def test_what_stood_in_for_two_effects_gives_way_to_them(two_hidden):
    findings = searched(two_hidden)
    assert _causes(findings) == set(HIDDEN)

    final, groups = findings.final, findings.final_groups
    reconsider(findings, (), lambda _: None)
    assert _causes(findings) == set(HIDDEN)
    assert findings.final is final  # what was found right stays as it was
    assert findings.final_groups is groups


@pytest.mark.study
def test_interrupted_while_asking_again_the_causes_stay(two_hidden):
    def progress(what):
        if interrupted or what.startswith("testing again"):
            interrupted.append(what)
        if len(interrupted) == 3:  # somewhere inside
            raise KeyboardInterrupt

    interrupted = []
    findings = searched(two_hidden, progress=progress)
    assert findings.is_interrupted
    assert len(findings.accepted) == 2
    assert findings.final.unknowns[-1].name.startswith(findings.accepted[-1].winner.id)
