"""What is said of a search: errors, gains, limits, pictures, plain values."""
