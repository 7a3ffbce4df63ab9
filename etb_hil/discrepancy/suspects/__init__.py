"""What may be a cause: effects and parameters, tried and fitted, and how collinear they are."""
