"""What a run has measured is let go with the last reference to it: hours of runs need the memory of one."""

import gc

from whole_run import run_briskly_on

from etb_hil.session.analysis import Analysis


def test_a_finished_run_needs_no_collector_to_be_let_go(tmp_path):
    run_briskly_on(tmp_path)  # what it compiles for the first time leaves circles of the compiler's own
    gc.collect()
    gc.disable()  # what is in a circle stays until the collector comes, which is rarely where arrays hold the memory
    try:
        before = [thing for thing in gc.get_objects() if type(thing) is Analysis]
        assert run_briskly_on(tmp_path).results.exit_code == 0
        left = [thing for thing in gc.get_objects() if type(thing) is Analysis]
    finally:
        gc.enable()
    assert len(left) <= len(before)
