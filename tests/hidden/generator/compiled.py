"""How the plant's functions are compiled."""

from functools import partial

from numba import njit

# None of them allocates: without reference counts on the arrays passed about, a step is five times as fast.
compiled = partial(njit, cache=True, error_model="numpy", _nrt=False)
