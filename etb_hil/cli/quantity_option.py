"""Options that are values with units, as files have them."""

from __future__ import annotations


def quantity_option(option: str, text: str, dimension: str) -> float:
    """Return an option's value in SI.

    InputError names the option and the units allowed.
    """
    from etb_hil.base.errors import InputError, Problem
    from etb_hil.base.quantity import parse_quantity

    try:
        return parse_quantity(text, dimension)
    except ValueError as error:
        raise InputError(Problem(f"{option}: {error}", value=text)) from None
