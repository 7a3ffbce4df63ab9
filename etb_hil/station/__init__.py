"""A station: its parts and limits, the units it takes, and its own fitness."""
