"""What a key function of security access is declared with.

`KEY = SecurityKey(...)`.
"""

from etb_hil.uds.keys import SecurityKey as SecurityKey
