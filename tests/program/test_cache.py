"""The cache: where it is, who may use it, and that nothing damaged is ever taken from it."""

import os
import shutil
import stat
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from multibody_sym.program import cache


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "multibody_sym"


def stored(key="key", content=b"content", metadata=None):
    path = cache.keep(content, "origin", ".so")
    cache.store(key, path, metadata or {"a": [1, "x"]})
    return path


def test_what_was_stored_is_found(place):
    path = stored()
    found = cache.find("key")
    assert (found.path, found.metadata) == (path, {"a": [1, "x"]})
    assert path.parent == place
    assert path.read_bytes() == b"content"
    assert cache.find("another key") is None


def test_the_folder_belongs_to_its_owner_alone(place):
    stored()
    assert stat.S_IMODE(place.stat().st_mode) == 0o700
    assert {stat.S_IMODE(file.stat().st_mode) for file in place.iterdir()} == {0o600}


def test_the_folder_is_not_shared_with_readers(place):
    place.mkdir(mode=0o755)
    assert cache.folder() == place
    assert stat.S_IMODE(place.stat().st_mode) == 0o700


def test_a_folder_that_others_can_write_is_not_used(place):
    place.mkdir()
    place.chmod(0o777)
    assert cache.folder() != place
    assert list(place.iterdir()) == []


def test_a_link_or_a_file_in_its_place_is_not_used(place, tmp_path):
    (tmp_path / "elsewhere").mkdir(mode=0o700)
    place.symlink_to(tmp_path / "elsewhere")
    assert cache.folder() != place
    place.unlink()
    place.write_text("a file")
    assert cache.folder() != place
    stored()
    assert cache.find("key") is not None


def test_a_folder_of_somebody_else_is_not_used(place, monkeypatch):
    cache.folder()
    monkeypatch.setattr(os, "geteuid", lambda: place.stat().st_uid + 1)
    assert cache.folder() != place


@pytest.mark.parametrize("value", ["relative/folder", ""])
def test_a_relative_cache_home_is_ignored(tmp_path, monkeypatch, value):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", value)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert cache.folder() == tmp_path / "home" / ".cache" / "multibody_sym"


@pytest.mark.parametrize("home", ["/proc/nowhere", "/dev/null"])
def test_without_a_writable_cache_a_temporary_folder_serves_and_goes(home):
    code = (
        "from multibody_sym.program import cache\n"
        "path = cache.keep(b'x', 'origin', '.so'); cache.store('key', path, {})\n"
        "import stat; print(path.parent, oct(stat.S_IMODE(path.parent.stat().st_mode)), cache.find('key').path == path)"
    )
    environment = {**os.environ, "XDG_CACHE_HOME": home, "HOME": home}
    run = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    folder, mode, found = run.stdout.split()
    assert (mode, found) == ("0o700", "True")
    assert not os.path.exists(folder)


def truncated(data):
    return data[: len(data) // 2]


def flipped(data):
    return bytes([*data[:-2], data[-2] ^ 1, data[-1]])


def emptied(data):
    return data[:0]


def garbage(data):
    return b"{]\n\xff\x00" * 10


@pytest.mark.parametrize("damage", [truncated, flipped, emptied, garbage])
@pytest.mark.parametrize("suffix", [".so", ".json"])
def test_damaged_files_are_not_found_and_can_be_stored_again(place, damage, suffix):
    path = stored()
    for file in place.glob(f"*{suffix}"):
        file.write_bytes(damage(file.read_bytes()))
    assert cache.find("key") is None
    assert stored() == path
    assert cache.find("key").path == path


def test_a_missing_file_is_not_found(place):
    stored().unlink()
    assert cache.find("key") is None


def test_an_entry_under_the_name_of_another_key_is_not_taken(place):
    stored("one")
    (entry,) = place.glob("*.json")
    entry.rename(place / f"{cache.digest('two')}.json")
    assert cache.find("two") is None


def test_other_content_gets_another_name(place):
    assert stored(content=b"1") != stored(content=b"2")


def test_nothing_half_written_is_left_behind(place, monkeypatch):
    def full(*_):
        raise OSError("no space left")

    cache.folder()
    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(OSError, match="no space"):
        stored()
    cache.store("key", place / "a-b.so", {})
    assert list(place.iterdir()) == []


def test_a_full_cache_loses_what_is_oldest(place, monkeypatch):
    monkeypatch.setattr(cache, "_MOST_FILES", 12)
    paths = []
    for number in range(8):
        paths.append(stored(f"key {number}", b"%d" % number))
        for file in place.iterdir():
            if file.stat().st_mtime > 1e9:
                os.utime(file, (number, number))
    assert cache.find("key 0") is None
    assert cache.find("key 7").path == paths[7]
    assert len(list(place.iterdir())) <= 13


def aged(place, seconds=1000.0):
    """Let all files be as if nobody had used them for long."""
    past = time.time() - seconds
    for file in place.iterdir():
        os.utime(file, (past, past))


def test_what_is_used_stays_in_a_full_cache(place, monkeypatch):
    monkeypatch.setattr(cache, "_MOST_FILES", 12)
    for number in range(6):
        stored(f"key {number}", b"%d" % number)
        aged(place, 1000.0 - number)
    assert cache.find("key 0") is not None  # the oldest, used now
    for number in range(6, 9):
        stored(f"key {number}", b"%d" % number)
    assert cache.find("key 0") is not None
    assert cache.find("key 1") is None


def test_what_somebody_holds_is_not_deleted(place, monkeypatch):
    monkeypatch.setattr(cache, "_MOST_FILES", 4)
    for number in range(4):
        stored(f"key {number}", b"%d" % number)
    with cache.keep_files():
        aged(place)
        before = set(os.listdir(place))
        stored("key 4", b"4")
        assert before < set(os.listdir(place))
    stored("key 5", b"5")
    assert cache.find("key 0") is None


def test_the_lock_of_a_killed_process_goes(place, monkeypatch):
    monkeypatch.setattr(cache, "_MOST_FILES", 2)
    cache.folder()
    (place / "0123.lock").touch()
    for number in range(2):
        stored(f"key {number}", b"%d" % number)
    assert not (place / "0123.lock").exists()


HOLDER = """
import sys, time
from multibody_sym.program import cache
with cache.alone("key"):
    print("in", flush=True)
    time.sleep(60)
"""


def test_one_at_a_time_makes_what_a_key_leads_to_and_a_killed_one_lets_go(place):
    environment = {**os.environ, "PYTHONPATH": str(Path(cache.__file__).parents[2])}
    holder = subprocess.Popen([sys.executable, "-c", HOLDER], env=environment, stdout=subprocess.PIPE, text=True)
    assert holder.stdout.readline() == "in\n"
    order = []

    def wait():
        with cache.alone("key"):
            order.append("waited")

    waiting = threading.Thread(target=wait)
    waiting.start()
    with cache.alone("another key"):
        order.append("another key")
    waiting.join(0.3)
    assert order == ["another key"]
    holder.kill()
    waiting.join(10)
    holder.communicate()
    assert order == ["another key", "waited"]
    assert not [name for name in os.listdir(place) if name.endswith(".lock")]


def test_threads_take_turns(place):
    inside, most = [], []

    def enter():
        with cache.alone("key"):
            inside.append(1)
            most.append(len(inside))
            time.sleep(0.01)
            inside.pop()

    threads = [threading.Thread(target=enter) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert most == [1] * 8


def test_nobody_waits_forever(place, monkeypatch):
    monkeypatch.setattr(cache, "_PATIENCE", 0.1)
    with cache.alone("key"):
        begin = time.monotonic()
        with cache.alone("key"):
            assert 0.1 <= time.monotonic() - begin < 5


def test_digests_tell_parts_apart():
    assert len({cache.digest("ab", "c"), cache.digest("a", "bc"), cache.digest("abc"), cache.digest("abc", "")}) == 4


def test_an_edited_template_is_another_toolkit(tmp_path):
    root = Path(cache.__file__).parents[2]
    for folder in ("multibody_sym", "templates"):
        shutil.copytree(root / folder, tmp_path / folder, ignore=shutil.ignore_patterns("__pycache__"))
    code = "from multibody_sym.program import cache; print(cache.__file__, cache.toolkit())"
    run = [sys.executable, "-c", code]
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    seen = [subprocess.run(run, env=environment, cwd=tmp_path, capture_output=True, text=True, check=True).stdout]
    assert seen[0].startswith(str(tmp_path))
    for template in ("c/model.c.in", "python/model.py.in", "c/runtime.c"):
        with open(tmp_path / "templates" / template, "a") as file:
            file.write("\n")
        done = subprocess.run(run, env=environment, cwd=tmp_path, capture_output=True, text=True, check=True)
        seen.append(done.stdout)
    assert len(set(seen)) == 4
