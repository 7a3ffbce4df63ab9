"""UDS as the virtual controller answers it.

The package has sessions, security access, data, trouble codes, routines and faults.
"""
