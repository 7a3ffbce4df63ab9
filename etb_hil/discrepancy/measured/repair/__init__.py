"""Detection and repair of the bench's own errors in a record; none is the unit's."""
