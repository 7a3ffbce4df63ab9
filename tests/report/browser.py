"""A headless Chromium that is handed one file and asked what it saw."""

import json
import re
import shutil
import subprocess

EXECUTABLE = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
_FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--hide-scrollbars",
    "--enable-logging=stderr",
    "--host-resolver-rules=MAP * ~NOTFOUND",
)


def open_page(page, folder, *flags, dark=False):
    """Open a page and return (console messages, addresses asked for on the page's behalf)."""
    profile = folder / f"profile-{len(list(folder.iterdir()))}"
    profile.mkdir()
    log = profile / "net.json"
    theme = ["--blink-settings=preferredColorScheme=0"] if dark else []
    command = [EXECUTABLE, *_FLAGS, *theme, f"--user-data-dir={profile}", f"--log-net-log={log}", *flags, page.as_uri()]
    run = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    console = [line for line in run.stderr.splitlines() if ":CONSOLE" in line]
    return console, _requests(log.read_text("utf-8"))


def _requests(text):
    """Return the addresses in a network log that a page asked for; a browser's own errands have no origin."""
    text = text.rstrip().rstrip(",")
    events = json.loads(text if text.endswith("}") else text + "]}")["events"]
    asked = [event["params"] for event in events if "initiator" in event.get("params", {})]
    return {p["url"] for p in asked if p["initiator"] != "not an origin" and re.match(r"(https?|wss?|ftp):", p["url"])}
