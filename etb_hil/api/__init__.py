"""The functions and types that `import etb_hil` offers.

The command line stands on them, too.
"""
