"""Declaration of a key function of security access.

A plug-in writes `KEY = SecurityKey(...)`.
"""

from etb_hil.uds.keys import SecurityKey as SecurityKey

__all__ = ["SecurityKey"]
