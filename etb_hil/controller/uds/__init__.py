"""UDS as the virtual controller answers it.

Sessions, security access, data, trouble codes, routines, and faults.
"""
