"""What holds for every test: kernels are compiled from the source as it is, and no machine's load fails a test."""

import os

from hypothesis import HealthCheck, settings

from etb_hil.base.compiled_cache import drop_stale

# The gate looks at the same examples every time; whoever hunts for new ones runs the tests by hand.
settings.register_profile(
    "etb_hil", deadline=None, suppress_health_check=[HealthCheck.too_slow], derandomize="CI" in os.environ
)
settings.load_profile("etb_hil")


def pytest_configure():
    drop_stale()
