"""What was measured, made ready: even rows of one shaft, and what rows do not say."""
