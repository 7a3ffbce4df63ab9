"""Scenarios: the phases of a run.

The phases of a scenario, their set-points over time, and conditions on signals.
"""
