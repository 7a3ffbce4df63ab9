"""The throttle as a state-space model: one step of its equations, its filter and its likelihood."""
