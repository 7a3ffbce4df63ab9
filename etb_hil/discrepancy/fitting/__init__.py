"""The residual of a measurement under parameters, and the fits that bring it down."""
