"""What a bench did to a record, found in the record alone and repaired; none of it is the unit's."""
