"""Files: an existing one is never harmed, and errors are OutputErrors."""

import os
import stat
from pathlib import Path

import pytest

from multibody_sym.errors import InputError, OutputError
from multibody_sym.text.files import replace_with, write_new, write_whole


def test_a_new_file_is_written(tmp_path):
    write_whole(tmp_path / "new", b"content")
    assert (tmp_path / "new").read_bytes() == b"content"
    assert os.listdir(tmp_path) == ["new"]


def test_permissions_follow_the_umask_or_the_replaced_file(tmp_path):
    old = os.umask(0o027)
    try:
        write_whole(tmp_path / "a", b"1")
    finally:
        os.umask(old)
    assert stat.S_IMODE((tmp_path / "a").stat().st_mode) == 0o640
    (tmp_path / "a").chmod(0o604)
    write_whole(tmp_path / "a", b"2")
    assert stat.S_IMODE((tmp_path / "a").stat().st_mode) == 0o604
    assert (tmp_path / "a").read_bytes() == b"2"


def test_a_link_stays_a_link(tmp_path):
    (tmp_path / "target").write_bytes(b"old")
    (tmp_path / "link").symlink_to("target")
    write_whole(tmp_path / "link", b"new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "target").read_bytes() == b"new"


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), ValueError("bad"), KeyboardInterrupt()])
def test_a_failing_writer_harms_nothing(tmp_path, error):
    target = tmp_path / "result"
    target.write_bytes(b"old")

    def write(file):
        file.write(b"half of the new")
        file.flush()
        raise error

    with pytest.raises(KeyboardInterrupt if isinstance(error, KeyboardInterrupt) else OutputError):
        replace_with(target, write)
    assert target.read_bytes() == b"old"
    assert os.listdir(tmp_path) == ["result"]


def test_a_disk_that_is_full_when_synced_harms_nothing(tmp_path, monkeypatch):
    target = tmp_path / "result"
    target.write_bytes(b"old")

    def full(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OutputError, match=r"result: the file cannot be written: No space left on device") as caught:
        write_whole(target, b"new")
    assert caught.value.exit_code == 4
    assert target.read_bytes() == b"old"
    assert os.listdir(tmp_path) == ["result"]


def test_a_process_that_hits_its_file_size_limit_harms_nothing(tmp_path):
    resource = pytest.importorskip("resource")
    target = tmp_path / "result"
    target.write_bytes(b"old")
    child = os.fork()
    if child == 0:
        import signal

        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
        try:
            write_whole(target, b"x" * 5000)
        except OutputError:
            os._exit(7)
        os._exit(0)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7
    assert target.read_bytes() == b"old"
    assert os.listdir(tmp_path) == ["result"]


def test_a_new_file_that_cannot_be_filled_is_not_left_behind(tmp_path, monkeypatch):
    def full(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OutputError, match="No space left"):
        write_new(tmp_path / "new", b"content")
    monkeypatch.undo()
    assert os.listdir(tmp_path) == []
    write_new(tmp_path / "new", b"content")
    with pytest.raises(InputError, match="exists already"):
        write_new(tmp_path / "new", b"other")
    assert (tmp_path / "new").read_bytes() == b"content"
    write_new("/dev/null", b"content")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_devices_are_written_to_directly():
    write_whole("/dev/null", b"x")
    with pytest.raises(OutputError, match="No space left"):
        write_whole("/dev/full", b"x")
    assert Path("/dev/full").is_char_device()


@pytest.mark.parametrize("name", ["no/such/folder/x", ".", "bad\0name"])
def test_impossible_targets(tmp_path, name):
    with pytest.raises(OutputError):
        write_whole(str(tmp_path) + "/" + name, b"x")
    assert os.listdir(tmp_path) == []


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everywhere")
def test_an_unwritable_folder(tmp_path):
    target = tmp_path / "result"
    target.write_bytes(b"old")
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(OutputError, match="Permission denied"):
            write_whole(target, b"new")
    finally:
        tmp_path.chmod(0o700)
    assert target.read_bytes() == b"old"


def test_a_folder_that_refuses_new_files(tmp_path, monkeypatch):
    target = tmp_path / "result"
    target.write_bytes(b"old")

    def refused(*args, **more):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(os, "open", refused)
    with pytest.raises(OutputError, match="Permission denied"):
        write_whole(target, b"new")
    monkeypatch.undo()
    assert target.read_bytes() == b"old"
