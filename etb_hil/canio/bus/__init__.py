"""The bus: links to real and virtual ones, bit timing at work, arbitration, faults, how it fares, what fits on it."""
