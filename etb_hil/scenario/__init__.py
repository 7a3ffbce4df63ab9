"""What a run is asked to do.

The phases of a scenario, their set-points over time, and conditions on signals.
"""
