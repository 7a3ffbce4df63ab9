"""What the page says of earlier runs."""

from dataclasses import replace

from report import sample_run

from etb_hil.page.past import Past
from etb_hil.store.address import StoreAddress
from etb_hil.store.queue import Queue


def test_the_yield_leaves_out_the_golden_unit(tmp_path):
    for number, (serial, stiction) in enumerate((("ETB-1", 0.171), ("ETB-2", 0.567), ("GOLD-1", 0.171))):
        results = sample_run.results(stiction, run_id=f"run-{number}", started=f"2026-11-20T07:00:0{number}Z")
        results = replace(results, unit=replace(results.unit, serial=serial))
        Queue(tmp_path).add(results, tmp_path / results.run_id)
    store = StoreAddress(tmp_path / "store.sqlite")
    recent = Past(tmp_path, store, "virtual classic", "GOLD-1").recent()
    assert (recent["judged"], recent["passed"], len(recent["runs"])) == (2, 1, 3)
    assert Past(tmp_path, store, "virtual classic").recent()["judged"] == 3
