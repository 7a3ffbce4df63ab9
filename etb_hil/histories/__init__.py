"""Statistics of many runs: control charts, capability, gauge R&R, drift.

The influence of temperature is taken out first.
"""
