"""A key function of security access: the seed's bytes, turned by the level and mixed with a constant."""

from etb_hil.plugins.keys import SecurityKey

SECRET = bytes.fromhex("5a3cc3a5")  # of this example; a real one does not belong into a repository


def _key(seed: bytes, level: int) -> bytes:
    turn = level % len(seed)
    turned = seed[turn:] + seed[:turn]
    return bytes(byte ^ SECRET[k % len(SECRET)] for k, byte in enumerate(turned))


KEY = SecurityKey(_key)
