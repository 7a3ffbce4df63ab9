"""Position laws: each one a file with its gains' design and its compiled torque."""
