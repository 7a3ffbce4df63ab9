"""A station: which parts it tests by which limits, which units it takes, and when it is fit to judge them."""
