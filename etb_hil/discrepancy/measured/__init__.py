"""What was measured, made ready: even samples of one shaft, and what samples do not say."""
