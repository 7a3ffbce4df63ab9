"""The throttle as a state-space model: one step of its equations, its filter, likelihood, sensitivities and fit."""
