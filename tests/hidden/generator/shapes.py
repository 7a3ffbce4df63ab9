"""Families of curve from which an effect's form is drawn, so that no single formula is the effect."""

import math

from generator.compiled import compiled


@compiled()
def wave(phase, form):
    """Periodic, amplitude one: 0 sine, 1 triangle, 2 sine with a second harmonic."""
    if form == 1.0:
        return 2.0 / math.pi * math.asin(math.sin(phase))
    if form == 2.0:
        return 0.85 * math.sin(phase) + 0.35 * math.sin(2.0 * phase + 0.7)
    return math.sin(phase)


@compiled()
def bump(x, form):
    """Local, height one, about the same width: 0 bell, 1 triangle, 2 raised cosine, 3 Lorentz."""
    if form == 1.0:
        return max(0.0, 1.0 - abs(x) / 1.8)
    if form == 2.0:
        return 0.5 + 0.5 * math.cos(math.pi * x / 2.0) if abs(x) < 2.0 else 0.0
    if form == 3.0:
        return 1.0 / (1.0 + 1.6 * x * x)
    return math.exp(-x * x)


@compiled()
def step(x, form):
    """Odd, saturating at one: 0 tanh, 1 rational, 2 clipped line, 3 arctangent."""
    if form == 1.0:
        return x / (1.0 + abs(x))
    if form == 2.0:
        return min(1.0, max(-1.0, 0.8 * x))
    if form == 3.0:
        return 2.0 / math.pi * math.atan(1.7 * x)
    return math.tanh(x)
