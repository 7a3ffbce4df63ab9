"""What a simulation gets wrong, why, and how much better it gets."""
