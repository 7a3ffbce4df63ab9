"""`python -m etb_hil` is `etb-hil`."""

import sys

from etb_hil.cli.main import main

sys.exit(main())
