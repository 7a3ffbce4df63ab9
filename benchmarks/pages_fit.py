"""Looks for cut-off code and missing pictures in the built documents: `python benchmarks/pages_fit.py build/docs`.

Opens each page in headless Chromium at the width of a screen and of a phone. A page must not be wider than the window,
no block of code wider than its frame, and each picture must load. The exit code is 1 where one of these fails.
"""

import shutil
import sys
from pathlib import Path

from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service

WIDTHS = (1280, 390)  # px
NO_PAGES = ("genindex.html", "search.html")
FAULTS = """return {
    "cut-off code": [...document.querySelectorAll("pre")].filter(one => one.scrollWidth > one.clientWidth + 1).length,
    "px too wide": Math.max(0, document.documentElement.scrollWidth - innerWidth - 1),
    "missing pictures": [...document.querySelectorAll("img")].filter(one => !one.naturalWidth).length,
}"""


def main(folder):
    pages = [
        page for page in sorted(folder.rglob("*.html")) if page.name not in NO_PAGES and "_static" not in page.parts
    ]
    failed = 0
    for width in WIDTHS:
        options = Options()
        for argument in ("--headless=new", "--no-sandbox", f"--window-size={width},900"):
            options.add_argument(argument)
        browser = webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))
        for page in pages:
            browser.get(page.as_uri())
            found = {what: count for what, count in browser.execute_script(FAULTS).items() if count}
            if found:
                failed += 1
                print(width, page.relative_to(folder), found)
        browser.quit()
    print(f"{len(pages)} pages at {len(WIDTHS)} widths, {failed} with faults")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve()))
