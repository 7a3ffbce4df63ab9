"""Signals in SI units on the controller's own sample clock."""
