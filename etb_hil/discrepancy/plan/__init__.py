"""What would distinguish what is open: planned scenarios, other records, numbers measured at the bench."""
