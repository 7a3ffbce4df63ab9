"""What a bench file may not say of the unit's diagnostics, refused with its place before anything moves."""

import pytest
import yaml

from etb_hil.base.errors import InputError
from etb_hil.base.stock import find
from etb_hil.bench.bench_file import load_bench


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"request": 0x900}, "uds: 'request' is 0x900; allowed: up to 0x7ff"),
        ({"response": 0x7E0}, "uds: 'request', 'response' share an identifier"),
        ({"periodic": 0x7E8}, "uds: 'response', 'periodic' share an identifier"),
        ({"timing": {"p2": "-1 ms"}}, "uds.timing.p2: out of range (it is '-1 ms'); allowed: above 0 s"),
        ({"timing": {"p2": "10000 s"}}, "uds.timing.p2: out of range (it is '10000 s'); allowed: up to 5 s"),
        ({"identification": {"serial": 0xF18C, "software": 0xF18C}}, "'serial', 'software' are read by the same"),
        ({"identification": {"colour": 0xF18C}}, "uds.identification.colour: no such entry; allowed: serial, "),
        ({"security": {"level": 2}}, "uds.security.level: a level is odd"),
        ({"security": {"key": "none"}}, "uds.security.key: must be a key function; there are example"),
        ({"status_mask": 0x1FF}, "uds.status_mask: out of range (it is 511); allowed: up to 255"),
    ],
)
def test_what_is_wrong_is_refused_by_its_key(tmp_path, changed, said):
    stock = yaml.safe_load(find("bench", "virtual_uds").read_text("utf-8"))
    path = tmp_path / "bench.yaml"
    path.write_text(yaml.safe_dump({**stock, "uds": {**stock["uds"], **changed}}, sort_keys=False))
    with pytest.raises(InputError) as caught:
        load_bench(path)
    assert said in str(caught.value)
    assert "bench.yaml:" in str(caught.value)
