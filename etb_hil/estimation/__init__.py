"""The throttle as a state-space model: its filter, likelihood and fit.

The package also holds one step of the equations, and the sensitivities.
"""
