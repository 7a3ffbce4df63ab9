"""Residuals of a measurement under parameters, and the fits that reduce them."""
