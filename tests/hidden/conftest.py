"""The generator is a package of its own beside these tests, never part of the package under test."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
