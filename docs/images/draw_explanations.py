"""Draws the pictures of the pages on `explain`: python docs/images/draw_explanations.py.

It follows docs/tutorials/first_explanation.md and takes pictures of the answers in headless Chromium.
"""

import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service

IMAGES = Path(__file__).parent / "explain"
PAGE = Path(__file__).parents[1] / "tutorials" / "first_explanation.md"
SIZE = (1000, 620)  # px of a picture: the verdict, and what stands below it


def main():
    with tempfile.TemporaryDirectory() as folder:
        text = PAGE.read_text("utf-8")
        for name, content in re.findall(r"```\{code-block\} yaml\n:caption: (\S+)\n(.*?)```", text, re.DOTALL):
            (Path(folder) / name).write_text(content, "utf-8")
        for command in re.findall(r"^    ((?:etb-hil|grep|cat) .*)$", text, re.MULTILINE):
            yes = " --yes" if command.startswith("etb-hil run") else ""
            subprocess.run(["bash", "-c", command + yes], cwd=folder, check=False)
        IMAGES.mkdir(exist_ok=True)
        for answer in ("answer", "answer_measured"):
            take(Path(folder) / answer / "explanation.html", IMAGES / f"{answer}.png")


def take(page, picture):
    options = Options()
    for argument in ("--headless=new", "--no-sandbox", "--hide-scrollbars", f"--window-size={SIZE[0]},{SIZE[1] + 143}"):
        options.add_argument(argument)
    browser = webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))
    browser.get(page.as_uri())
    browser.save_screenshot(str(picture))
    browser.quit()


if __name__ == "__main__":
    sys.exit(main())
