"""UDS as the virtual controller answers it: sessions, security access, data, trouble codes, routines, and faults."""
