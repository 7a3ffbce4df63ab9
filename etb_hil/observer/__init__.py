"""Friction torque from current and angle, by sliding modes."""
