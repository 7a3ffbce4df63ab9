"""The stepwise search for causes, and the rejection criteria."""
