"""What a key function of security access is declared with.

A plug-in writes `KEY = SecurityKey(...)`.
"""

from etb_hil.uds.keys import SecurityKey as SecurityKey
