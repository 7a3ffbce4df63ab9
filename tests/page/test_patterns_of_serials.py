"""Patterns of serial numbers are Python's: the page says only what JavaScript reads in the same way."""

import re

import pytest

TAKES = """
const [pattern, serial, done] = arguments;
import("/static/parts.js").then((parts) => done(parts.takes(pattern, serial)), (error) => done(String(error)));
"""


@pytest.mark.parametrize(
    ("pattern", "serial", "said"),
    [
        ("OK-[0-9]+", "OK-1", True),
        ("OK-[0-9]+", "XX-1", False),
        (r"OK\-[\w\-.]+\.\\", r"OK-a-b.\\"[:-1], True),
        (r"A|B", "AB", False),
        ("(?i)ok-[0-9]+", "OK-1", None),
        ("OK-[0-9]++", "OK-1", None),
        (r"OK-\d+\Z", "OK-1Z", None),
        ("OK-[0-9]{,3}", "OK-1", None),
        (r"\w+", "ÄÖ", None),
    ],
)
def test_the_page_says_what_python_says_or_nothing(page, browser, pattern, serial, said):
    browser.get(page.address)
    assert browser.execute_async_script(TAKES, pattern, serial) is said
    assert said in {None, re.fullmatch(pattern, serial) is not None}
