"""What every test shares."""

from hypothesis import settings

# A machine's load and a kernel's first compilation must not fail a test.
settings.register_profile("etb_hil", deadline=None)
settings.load_profile("etb_hil")
