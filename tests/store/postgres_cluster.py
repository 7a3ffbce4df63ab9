"""A real PostgreSQL server, made for a test in a temporary folder, on loopback."""

import os
import pwd
import signal
import socket
import subprocess
import time
from pathlib import Path

import psycopg

BINARIES = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"))


class Cluster:
    """A PostgreSQL server; as root, it runs as the user that Debian's package makes for it."""

    def __init__(self, folder, settings="fsync = off"):
        self.folder, self.data = folder, folder / "data"
        self.user = "postgres" if os.geteuid() == 0 else None
        if self.user:
            entry = pwd.getpwnam(self.user)
            os.chown(folder, entry.pw_uid, entry.pw_gid)
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        # `trust` on loopback: what passwords do is asked in a test of its own
        self.tool("initdb", "-D", str(self.data), "-A", "trust", "-U", "bench", "-N", "--no-instructions")
        with (self.data / "postgresql.conf").open("a") as file:
            file.write(
                f"port = {self.port}\nlisten_addresses = '127.0.0.1'\nunix_socket_directories = ''\n{settings}\n"
            )

    def tool(self, name, *arguments):
        done = subprocess.run(
            [str(BINARIES[-1].with_name(name)), *arguments],
            user=self.user, cwd="/", check=False, text=True, timeout=60,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )  # fmt: skip
        assert done.returncode == 0, done.stdout

    def control(self, *words):
        self.tool("pg_ctl", "-D", str(self.data), "-l", str(self.folder / "log"), "-w", *words)

    def start(self):
        self.control("start")

    def stop(self):
        self.control("stop", "-m", "immediate")

    def kill(self):
        process = int((self.data / "postmaster.pid").read_text().splitlines()[0])
        os.kill(process, signal.SIGKILL)
        end = time.monotonic() + 120.0
        while Path(f"/proc/{process}").exists() and time.monotonic() < end:
            time.sleep(0.02)

    def url(self, database="postgres"):
        return f"postgresql://bench@127.0.0.1:{self.port}/{database}"

    def new_database(self, name):
        with psycopg.connect(self.url(), autocommit=True) as connection:
            connection.execute(f"CREATE DATABASE {name}")
        return self.url(name)
