"""Who may ask the page for what; and that a test goes on whatever becomes of the page."""

import http.client
import json
import signal
import socket
import stat
import subprocess
import sys
from contextlib import ExitStack

import pytest
import served
from served import until
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from etb_hil.page.password import Password, set_password
from etb_hil.page.visitors import AWAY_S, IDLE_S, LONGEST_S, MOST_SESSIONS, Holder, Rate, Visitors


@pytest.fixture
def alone(tmp_path):
    """Serve a page that no other test uses."""
    with ExitStack() as pages:
        yield lambda *options: pages.enter_context(
            served.Served(tmp_path, *(options or ("--station", str(served.station(tmp_path)))))
        )


def told(page, cookie, key="about"):
    """Return what an open page is told first."""
    origin = f"http://127.0.0.1:{page.port}"
    with connect(f"ws://127.0.0.1:{page.port}/live", origin=origin, additional_headers={"Cookie": cookie}) as socket_:
        return json.loads(socket_.recv())[key]


def take(page, name="B. Beispiel"):
    cookie = page.visit()
    assert page.ask("POST", "/api/hold", {"operator": name}, cookie)[0] == 200
    return cookie


@pytest.mark.parametrize("headers", [{"Host": "evil.example"}, {"Host": "127.0.0.1.evil.example:80"}])
def test_another_name_for_this_page_is_refused(page, headers):
    assert page.ask("GET", "/", **headers)[0] == 421


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "", "http://127.0.0.1:1"])
def test_an_order_from_another_page_is_refused(page, origin):
    cookie = page.visit()
    for path in ("/api/hold", "/api/start", "/api/stop"):
        assert page.ask("POST", path, {"operator": "E"}, cookie, Origin=origin)[0] == 403
    with pytest.raises(InvalidStatus):
        connect(f"ws://127.0.0.1:{page.port}/live", origin=origin or None, additional_headers={"Cookie": cookie})


def test_without_a_session_nothing_is_told_or_done(page):
    assert page.ask("POST", "/api/start", {"serial": "OK-1"})[0] == 401
    assert page.ask("POST", "/api/stop", {})[0] == 401
    assert page.ask("GET", "/api/history")[0] == 401
    with pytest.raises((ConnectionClosed, InvalidStatus)):
        told(page, "etb_hil=nobody")


def test_who_does_not_hold_the_bench_looks_and_stops(page):
    holder, other = take(page), page.visit()
    status, _, body = page.ask("POST", "/api/start", {"serial": "AS-7"}, other)
    assert (status, json.loads(body)["why"]) == (403, "not_holder")
    assert page.ask("POST", "/api/hold", {"operator": "Other"}, other)[0] == 409
    assert page.ask("POST", "/api/start", {"serial": "AS-7"}, holder)[0] == 200
    until(lambda: told(page, other, "news")["prompt"])
    assert page.ask("POST", "/api/answer", {"number": 1, "answer": "done"}, other)[0] == 403
    assert page.ask("POST", "/api/start", {"serial": "AS-8"}, holder)[0] == 409
    assert page.ask("POST", "/api/stop", {}, other)[0] == 200
    until(lambda: told(page, other)["status"] == "done")
    assert told(page, other)["outcome"]["headline"] == "ABORTED"
    assert page.ask("POST", "/api/stop", {}, other)[0] == 409
    page.ask("POST", "/api/release", {}, holder)


@pytest.mark.parametrize("path", ["..%2F..%2Fetc%2Fpasswd", "..", "%00", "no-such-run"])
def test_a_report_lies_in_a_session_and_nowhere_else(page, path):
    assert page.ask("GET", f"/report/{path}", cookie=page.visit())[0] in {400, 404}


@pytest.mark.parametrize("body", [b"", b"[]", b"{", b"\xff", b"x" * 100_000, b'{"serial": 1, "number": []}'])
def test_a_body_that_is_no_order_is_refused(page, body):
    cookie = take(page)
    for path in ("/api/start", "/api/answer", "/api/hold"):
        connection = http.client.HTTPConnection("127.0.0.1", page.port, timeout=120)
        own = f"127.0.0.1:{page.port}"
        connection.request("POST", path, body, {"Host": own, "Origin": f"http://{own}", "Cookie": cookie})
        assert 400 <= connection.getresponse().status < 500
        connection.close()
    page.ask("POST", "/api/release", {}, cookie)


def test_a_test_goes_on_without_its_page_which_finds_it_again(alone):
    page = alone()
    cookie = take(page)
    page.ask("POST", "/api/start", {"serial": "AS-1"}, cookie)
    until(lambda: told(page, cookie, "news")["prompt"])
    page.end(signal.SIGKILL)
    page.start()
    cookie = take(page)
    assert told(page, cookie)["run"]["serial"] == "AS-1"
    asked = until(lambda: told(page, cookie, "news")["prompt"])
    assert page.ask("POST", "/api/answer", {"number": asked["number"], "answer": "stop"}, cookie)[0] == 200
    until(lambda: told(page, cookie)["status"] == "done")
    outcome = told(page, cookie)["outcome"]
    assert outcome["headline"] == "ABORTED"
    assert outcome["is_safe"] is True
    page.end()
    page.start()  # what came of a run is there again, too
    assert told(page, page.visit())["outcome"]["headline"] == "ABORTED"


def test_a_run_that_was_killed_is_a_bench_fault(alone):
    page = alone()
    cookie = take(page)
    page.ask("POST", "/api/start", {"serial": "AS-1"}, cookie)
    until(lambda: told(page, cookie, "news")["prompt"])
    subprocess.run(["kill", "-9", str(told(page, cookie)["run"]["process"])], check=True)
    until(lambda: told(page, cookie)["status"] == "done")
    outcome = told(page, cookie)["outcome"]
    assert outcome["headline"] == "BENCH FAULT"
    assert "supply off" in outcome["next_step"]


def test_a_host_needs_a_password_that_others_cannot_read(tmp_path):
    def refused(*options):
        done = subprocess.run(
            [sys.executable, "-m", "etb_hil", "page", "--port", "0", *options],
            cwd=tmp_path, capture_output=True, text=True, check=False, timeout=60,
        )  # fmt: skip
        assert done.returncode == 2
        return done.stderr

    assert "--host needs a password" in refused("--host", "127.0.0.1")
    path = tmp_path / "password"
    set_password(path, "correct horse")
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert "correct" not in path.read_text()
    assert Password(path).fits("correct horse")
    assert not Password(path).fits("correct horse ")
    path.chmod(0o644)
    assert "others can read" in refused("--host", "127.0.0.1", "--password-file", str(path))
    path.write_text("correct horse")
    path.chmod(0o600)
    assert "must be a password file" in refused("--host", "127.0.0.1", "--password-file", str(path))


def test_a_password_is_asked_for_and_may_not_be_guessed(alone, tmp_path):
    path = tmp_path / "password"
    set_password(path, "correct horse")
    page = alone("--host", "127.0.0.1", "--password-file", str(path))
    assert page.ask("GET", "/")[0] == 303
    assert page.ask("GET", "/api/history")[0] == 401
    assert page.ask("POST", "/api/login", {"password": "\ud800"})[0] == 401
    status, headers, _ = page.ask("POST", "/api/login", {"password": "correct horse"})
    assert status == 200
    cookie = headers["Set-Cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=strict" in cookie
    assert page.ask("GET", "/", cookie=cookie.split(";")[0])[0] == 200
    tries = [
        page.ask("POST", "/api/login", {"password": f"guess {k}"}, X_Forwarded_For=f"192.0.2.{k}")[0] for k in range(6)
    ]
    assert tries == [401, 401, 401, 429, 429, 429]
    assert page.ask("POST", "/api/logout", {}, cookie.split(";")[0])[0] == 200
    assert page.ask("GET", "/", cookie=cookie.split(";")[0])[0] == 303


def test_a_page_on_this_machine_alone_is_on_no_other_address(page):
    with socket.socket() as other:
        other.settimeout(2.0)
        with pytest.raises(OSError, match=r"refused|unreachable"):
            other.connect(("127.0.0.2", page.port))


def test_sessions_end_and_the_bench_may_be_taken_from_who_is_away():
    now = [0.0]
    visitors = Visitors(lambda: now[0])
    first, second = visitors.let_in(), visitors.let_in()
    holder = Holder(lambda: now[0])
    assert holder.take(first, "A")
    assert not holder.take(second, "B")
    first.pages = 1
    now[0] = 10.0 * AWAY_S
    assert not holder.take(second, "B")
    first.pages = 0
    now[0] += AWAY_S + 1.0
    assert holder.take(second, "B")
    now[0] = IDLE_S + 1.0
    assert visitors.find(first.token) is None
    second.pages = 1
    assert visitors.find(second.token) is second
    now[0] = LONGEST_S + 1.0
    assert visitors.is_over(second)


def test_too_many_sessions_end_the_idle_ones_alone():
    now = [0.0]
    visitors = Visitors(lambda: now[0])
    watching, holding, used, idle = (visitors.let_in() for _ in range(4))
    watching.pages = 1
    for _ in range(2 * MOST_SESSIONS):
        now[0] += 0.1
        visitors.find(used.token)
        visitors.let_in(holding)
    assert [visitors.is_over(one) for one in (watching, holding, used, idle)] == [False, False, False, True]


def test_a_rate_counts_each_key_alone_and_forgets():
    now = [0.0]
    rate = Rate(2, 10.0, lambda: now[0])
    assert [rate.allows("a"), rate.allows("a"), rate.allows("a"), rate.allows("b")] == [True, True, False, True]
    now[0] = 11.0
    assert rate.allows("a")
    for key in range(1000):
        now[0] += 1.0
        rate.allows(str(key))
    assert rate.allows("z")
    assert len(repr(rate)) < 2_000  # it keeps the keys of the last ten seconds
