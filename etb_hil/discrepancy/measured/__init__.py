"""Measured signals made ready: evenly sampled, at one shaft, with known limits."""
