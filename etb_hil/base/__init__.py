"""The ground floor: errors, units, files that people write, roles of signals, clocks."""
