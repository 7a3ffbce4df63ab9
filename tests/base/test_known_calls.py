"""Numba searches once how a function of its own is called with some types and options."""

import numpy as np
import pytest
from numba.core.compiler import Flags
from numba.core.targetconfig import ConfigStack

from etb_hil.base.compiled import njit
from etb_hil.base.known_calls import remembering


class Signature:
    def __init__(self, args):
        self.args = args


class Function:
    """A function of which each search finds another code."""

    def __init__(self):
        self._impl_keys = {}
        self.searches = 0
        self.call_type = remembering(Function.search)

    def search(self, _context, args, _kws):
        self.searches += 1
        if args == ("unknown",):
            raise TypeError
        self._impl_keys[args] = self.searches
        return Signature(args)

    def code(self, *args):
        return self._impl_keys[self.call_type(self, "context", args, {}).args]


def flags(error_model):
    found = Flags()
    found.error_model = error_model
    return found


def test_the_same_types_and_options_are_searched_once():
    one = Function()
    assert [one.code("float64"), one.code("int64"), one.code("float64")] == [1, 2, 1]


def test_other_options_are_searched_anew_and_equal_ones_are_not():
    one, found = Function(), []
    for error_model in ("python", "numpy", "python"):
        with ConfigStack().enter(flags(error_model)):
            found.append(one.code("float64"))
    assert found == [1, 2, 1]


def test_an_error_is_not_remembered():
    one = Function()
    for _ in range(2):
        with pytest.raises(TypeError):
            one.code("unknown")
    assert one.searches == 2


def test_a_division_by_zero_stays_what_each_function_says():
    for _ in range(2):
        with pytest.raises(ZeroDivisionError):
            njit(cache=False)(lambda a: 1.0 / a)(0.0)
        assert njit(cache=False, error_model="numpy")(lambda a: 1.0 / a)(0.0) == np.inf


def test_a_wrapper_of_the_caller_is_no_other_option():
    one, found = Function(), []
    for has_none in (False, True):
        options = flags("numpy")
        options.no_cpython_wrapper = has_none
        with ConfigStack().enter(options):
            found.append(one.code("float64"))
    assert found == [1, 1]
