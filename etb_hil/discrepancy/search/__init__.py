"""The search for causes, and what was found."""
