"""Friction torque from current and angle, while they arrive."""
