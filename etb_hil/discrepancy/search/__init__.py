"""The loop that takes in one cause after another, and what speaks against each."""
