"""What all else rests on: errors, units, files that people write, roles, clocks."""
