"""The operator page as a benchmark drives it: its process, a headless browser that shows it, and orders by HTTP."""

import http.client
import json
import shutil
import subprocess
import time
from contextlib import contextmanager

from selenium import webdriver


@contextmanager
def process_of(words):
    """Run a command of ours until the block ends; yields the first line that it prints, and its process id."""
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        try:
            yield process.stdout.readline().strip(), process.pid
        finally:
            process.terminate()


@contextmanager
def chromium(address, pages):
    """Show an address in so many tabs of a headless browser, which is yielded."""
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium")
    for flag in ("--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking"):
        options.add_argument(flag)
    browser = webdriver.Chrome(options, webdriver.ChromeService(shutil.which("chromedriver")))
    try:
        browser.get(address)
        for _ in range(pages - 1):
            browser.switch_to.new_window("tab")
            browser.get(address)
        time.sleep(2.0)
        yield browser
    finally:
        browser.quit()


def order(port, what, cookie, **content):
    """Send an order to the page as its own script does."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
    own = {"Origin": f"http://127.0.0.1:{port}", "Cookie": cookie}
    connection.request("POST" if what else "GET", f"/api/{what}" if what else "/", json.dumps(content), own)
    answer = connection.getresponse()
    answer.read()
    assert answer.status == 200, (what, answer.status)
    return answer.headers.get("Set-Cookie", "").split(";")[0]
