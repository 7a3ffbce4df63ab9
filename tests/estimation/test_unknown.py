"""Which signs numbers of a model may have in a fit."""

from pathlib import Path

import numpy as np
import pytest

from etb_hil.estimation.unknown import base_unknowns
from etb_hil.plant.parameters import Model

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"


def lowest(model):
    return {one.name: one.low for one in base_unknowns(model)}


def test_a_constant_load_of_a_drive_may_act_either_way():
    """The example's is stated as 0.1 N within 10 N; the published one is -3.2 N."""
    found = lowest(Model.load(EXAMPLES / "emps.drive.yaml"))
    assert found["preload_open"] == -np.inf
    assert found["coulomb"] > 0.0
    assert found["inertia"] > 0.0


@pytest.mark.parametrize("name", ["preload_open", "limp_home", "coulomb"])
def test_what_a_throttle_has_stays_above_zero(name):
    assert lowest(Model.load("default"))[name] > 0.0
