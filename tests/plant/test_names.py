"""Effects and base parameters have one name for people."""

from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.names import display_name
from etb_hil.plant.table_one import KINDS


def test_each_effect_and_base_parameter_has_a_name_of_its_own():
    names = [display_name(id_) for id_ in (*CATALOGUE, *KINDS)]
    assert len(set(names)) == len(names)
    assert not any("_" in name for name in names)


def test_names_are_no_raw_keys():
    assert [display_name(id_) for id_ in ("hbridge_dead_time", "stop_low")] == ["H-bridge dead time", "lower stop"]
