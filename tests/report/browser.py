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
    theme = ["--blink-settings=preferredColorScheme=0"] if dark else []
    profile = _profile(folder)
    log = profile / "net.json"
    run = _run(page, profile, *theme, f"--log-net-log={log}", *flags)
    console = [line for line in run.stderr.splitlines() if ":CONSOLE" in line]
    return console, _requests(log.read_text("utf-8"))


def dom(page, folder):
    """Return a page as it stands once its scripts have run."""
    return _run(page, _profile(folder), "--dump-dom").stdout


def _profile(folder):
    profile = folder / f"profile-{len(list(folder.iterdir()))}"
    profile.mkdir()
    return profile


def _run(page, profile, *flags):
    command = [EXECUTABLE, *_FLAGS, f"--user-data-dir={profile}", *flags, page.as_uri()]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)


def _requests(text):
    """Return the addresses in a network log that a page asked for; a browser's own errands have no origin."""
    text = text.rstrip().rstrip(",")
    events = json.loads(text if text.endswith("}") else text + "]}")["events"]
    asked = [event["params"] for event in events if "initiator" in event.get("params", {})]
    return {p["url"] for p in asked if p["initiator"] != "not an origin" and re.match(r"(https?|wss?|ftp):", p["url"])}
