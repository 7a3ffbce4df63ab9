"""What many runs say together: charts, capability, gauge R&R, drift.

The influence of temperature is taken out first.
"""
