"""A file is there whole or not at all, whatever happens while it is written."""

import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

from etb_hil.base.errors import InputError
from etb_hil.base.files import make_folder, must_not_replace, replacing, write_text

SLOW_WRITER = """
import sys, time
from pathlib import Path
from etb_hil.base.files import replacing
with replacing(Path(sys.argv[1])) as part:
    part.write_text("half")
    print("begun", flush=True)
    time.sleep(600)
"""


def test_a_written_file_stands_alone(tmp_path):
    assert write_text(tmp_path / "new.txt", "äöü\n") == tmp_path / "new.txt"
    assert (tmp_path / "new.txt").read_bytes() == "äöü\n".encode()
    assert [path.name for path in tmp_path.iterdir()] == ["new.txt"]


def test_an_error_on_the_way_leaves_the_earlier_file(tmp_path):
    write_text(tmp_path / "a.txt", "before")

    def interrupted():
        with replacing(tmp_path / "a.txt") as part:
            part.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert (tmp_path / "a.txt").read_text() == "before"
    assert len(list(tmp_path.iterdir())) == 1


def test_a_killed_writer_leaves_the_earlier_file(tmp_path):
    write_text(tmp_path / "a.txt", "before")
    command = [sys.executable, "-c", SLOW_WRITER, str(tmp_path / "a.txt")]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as writer:
        assert writer.stdout.readline() == b"begun\n"
        writer.kill()
    assert (tmp_path / "a.txt").read_text() == "before"


def test_readers_see_the_whole_old_or_the_whole_new_file(tmp_path):
    path = write_text(tmp_path / "a.txt", "0" * 100_000)
    code = "import sys; from pathlib import Path; from etb_hil.base.files import write_text\n"
    code += "for k in range(30): write_text(Path(sys.argv[1]), str(k % 10) * 100_000)"
    with subprocess.Popen([sys.executable, "-c", code, str(path)]) as writer:
        while writer.poll() is None:
            text = path.read_text()
            assert len(text) == 100_000
            assert len(set(text)) == 1
            time.sleep(0.001)
    assert path.read_text() == "9" * 100_000


def test_a_link_stays_and_its_file_is_replaced(tmp_path):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "elsewhere" / "file")
    write_text(tmp_path / "link", "text")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "elsewhere" / "file").read_text() == "text"


def test_the_longest_name_can_be_written(tmp_path):
    name = "n" * 251 + ".csv"
    with replacing(tmp_path / name) as part:
        assert part.suffix == ".csv"
        part.write_text("text")
    assert (tmp_path / name).read_text() == "text"


def test_a_device_is_never_replaced(tmp_path):
    os.mkfifo(tmp_path / "fifo")
    for path in (tmp_path / "fifo", Path("/dev/null")):
        with pytest.raises(InputError, match="is a device or a pipe, which no file replaces"):
            write_text(path, "text")
        assert not path.is_file()
        assert path.exists()


@pytest.mark.parametrize(
    ("name", "told"), [("", "Is a directory"), ("none/x", "No such file or directory"), ("file/x", "Not a directory")]
)
def test_a_place_that_takes_no_file_is_refused_by_its_name(tmp_path, name, told):
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match=rf"{tmp_path / name}: cannot be written: {told}; choose another place"):
        write_text(tmp_path / name, "text")


def test_a_folder_below_a_file_cannot_be_made(tmp_path):
    (tmp_path / "file").touch()
    assert make_folder(tmp_path / "a" / "b").is_dir()
    with pytest.raises(InputError, match="cannot be written: "):
        make_folder(tmp_path / "file" / "b")


def test_an_output_takes_the_place_of_no_input_and_of_no_other_output(tmp_path):
    read, new, link, way = (tmp_path / name for name in ("read", "new", "link", "way"))
    read.write_text("x")
    link.symlink_to(read)
    way.symlink_to(tmp_path)
    must_not_replace([(new, "a"), (tmp_path / "other", "b")], [read, link, tmp_path / "missing"])
    for path in (read, link, way / "read", tmp_path / "." / "read"):
        with pytest.raises(InputError, match=re.escape(f"{read}: is read here, and the output")):
            must_not_replace([(path, "a")], [read])
    with pytest.raises(InputError) as caught:
        must_not_replace([(new, "a"), (link, "b"), (way / "new", "c")], [read])
    assert [problem.remedy for problem in caught.value.problems] == ["b", "c"]
    assert "two outputs would be written to one file" in str(caught.value)
