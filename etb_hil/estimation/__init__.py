"""The throttle as a state-space model: its filter, likelihood and fit.

It has one step of the equations, and sensitivities, too.
"""
