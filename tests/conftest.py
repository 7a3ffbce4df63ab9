"""What holds for every test: kernels are compiled from the source as it is, and no machine's load fails a test."""

from hypothesis import settings

from etb_hil.base.compiled_cache import drop_stale

settings.register_profile("etb_hil", deadline=None)
settings.load_profile("etb_hil")


def pytest_configure():
    drop_stale()
