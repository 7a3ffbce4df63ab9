"""Position laws: each one a file of `kinds` with its gains' design and its compiled torque."""
