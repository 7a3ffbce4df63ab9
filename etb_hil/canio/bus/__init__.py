"""The bus: links to real and virtual ones, arbitration, faults, health.

Bit timing is at work here, and what fits on a bus.
"""
