"""What would tell apart what is open: planned scenarios, other records, numbers measured by hand."""
