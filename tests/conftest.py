"""What holds for every test: kernels are compiled from the source as it is."""

from etb_hil.base.compiled_cache import drop_stale


def pytest_configure():
    drop_stale()
