"""The sentence that names the component which all indistinguishable causes sit in."""

import pytest

from etb_hil.report.explain_verdict import one_component
from etb_hil.results.explained.causes import Cause
from etb_hil.results.explanation import ExplanationResult

FRICTION = "friction of bearings, seals and gear"


def _cause(id_, component):
    return Cause(id_, 0.5, ("presliding_hysteresis",), {}, 0.5, component=component)


@pytest.mark.parametrize(
    ("verdict", "components", "says"),
    [
        ("ambiguous", [FRICTION, FRICTION], f"All possible causes sit in one component: {FRICTION}."),
        ("ambiguous", [FRICTION, "motor"], ""),
        ("ambiguous", [FRICTION, ""], ""),
        ("ambiguous", [""], ""),
        ("explained", [FRICTION], ""),
        ("adequate", [], ""),
    ],
)
def test_a_component_is_named_where_all_causes_sit_in_it(verdict, components, says):
    causes = tuple(_cause(f"parameter:{k}", one) for k, one in enumerate(components))
    assert one_component(ExplanationResult(verdict, causes)) == says
