"""The one thing that flows: signals in SI units on the controller's own sample clock."""
