"""The kinds of phase: each one a file that declares it as `PHASE`."""
