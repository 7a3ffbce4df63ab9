"""Basic types: errors, units, input files, roles of signals, clocks."""
