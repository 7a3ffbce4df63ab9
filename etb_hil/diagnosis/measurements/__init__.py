"""The measurements: one file each, with the declaration `KIND` and the function that computes the value."""
