"""The compiler: how it is found, that it is neither trusted nor waited for without end."""

import os
import shutil
import threading
import time

import pytest
from hand_models import OSCILLATOR

from multibody_sym.program import cache
from multibody_sym.program import loading as module
from multibody_sym.program.loading import CompilerError, begin_runtime, build_library, find_compiler

REAL = shutil.which("cc") or shutil.which("gcc")


def script(path, text):
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return path


@pytest.fixture
def fresh(tmp_path, monkeypatch):
    """An empty cache, no CC, and a PATH with nothing but the real compiler's neighbours."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(module, "_FLAGS", tuple(flag for flag in module._FLAGS if flag != "-O2"))  # compiles sooner
    return tmp_path


def test_the_compiler_is_an_absolute_path(fresh):
    assert os.path.isabs(find_compiler().command[0])


@pytest.mark.parametrize("entry", ["", ".", "here", "absolute"])
def test_the_working_folder_is_not_searched(fresh, monkeypatch, entry):
    here = fresh / "here"
    here.mkdir()
    trap = script(here / "cc", f"touch {fresh}/sprung")
    monkeypatch.chdir(fresh if entry == "here" else here)
    first = str(here) if entry == "absolute" else entry
    monkeypatch.setenv("PATH", os.pathsep.join([first, os.environ["PATH"]]))
    found = find_compiler()
    assert found.command[0] != str(trap)
    build_library(found, OSCILLATOR.sources())
    assert not (fresh / "sprung").exists()


def test_cc_names_the_compiler_and_its_arguments(fresh, monkeypatch):
    mine = script(fresh / "my compiler", f'exec {REAL} "$@"')
    monkeypatch.setenv("CC", f"'{mine}' -DA='b c'")
    assert find_compiler().command == (str(mine), "-DA=b c")
    assert build_library(find_compiler(), OSCILLATOR.sources()).exists()


@pytest.mark.parametrize("value", ["./cc", "no-such-compiler", "/no/such/compiler", "'unbalanced"])
def test_a_cc_that_cannot_be_used_is_an_error_and_nothing_else_is_tried(fresh, monkeypatch, value):
    script(fresh / "cc", "exit 0")
    monkeypatch.chdir(fresh)
    monkeypatch.setenv("CC", value)
    with pytest.raises(CompilerError, match="CC"):
        find_compiler()


def test_no_shell_reads_the_command(fresh, monkeypatch):
    monkeypatch.setenv("CC", f"{REAL} ; touch {fresh}/sprung")
    with pytest.raises(CompilerError):
        build_library(find_compiler(), OSCILLATOR.sources())
    assert not (fresh / "sprung").exists()


def test_without_a_compiler_the_error_says_what_was_sought(fresh, monkeypatch):
    monkeypatch.setattr(module, "_zig", lambda: None)
    monkeypatch.setenv("PATH", str(fresh))
    with pytest.raises(CompilerError, match="none of cc, gcc, clang"):
        find_compiler()


def test_a_failing_compiler_is_an_error_with_its_message(fresh, monkeypatch):
    monkeypatch.setenv("CC", str(script(fresh / "bad", "echo 'bad: fatal error: out of paper' >&2; exit 3")))
    with pytest.raises(CompilerError, match="out of paper"):
        build_library(find_compiler(), OSCILLATOR.sources())


def test_a_file_that_is_no_program_is_an_error(fresh, monkeypatch):
    (fresh / "odd").write_bytes(b"\x7fELF nothing")
    (fresh / "odd").chmod(0o755)
    monkeypatch.setenv("CC", str(fresh / "odd"))
    with pytest.raises(CompilerError, match="cannot be started"):
        build_library(find_compiler(), OSCILLATOR.sources())


def test_a_compiler_that_writes_nothing_is_an_error(fresh, monkeypatch):
    monkeypatch.setenv("CC", "/bin/true")
    with pytest.raises(CompilerError, match="wrote no"):
        build_library(find_compiler(), OSCILLATOR.sources())


def test_the_end_of_a_compiler_is_not_looked_for_in_ticks(fresh, monkeypatch):
    slow = script(fresh / "slow", '[ "$1" = --version ] && echo slow && exit 0\nexec sleep 0.02')
    monkeypatch.setenv("CC", str(slow))
    ticks = list[float]()
    monkeypatch.setattr(time, "sleep", ticks.append)
    with pytest.raises(CompilerError, match="wrote no"):
        build_library(find_compiler(), OSCILLATOR.sources())
    assert not ticks


def test_a_hanging_compiler_is_ended_with_all_it_started(fresh, monkeypatch):
    monkeypatch.setattr(module, "_SECONDS", 0.2)
    monkeypatch.setattr(module, "_BYTES_PER_SECOND", 1e9)
    hanging = script(fresh / "slow", f'[ "$1" = --version ] && echo slow && exit 0\nsleep 1\ntouch {fresh}/late')
    monkeypatch.setenv("CC", str(hanging))
    begin = time.monotonic()
    with pytest.raises(CompilerError, match="took more than"):
        build_library(find_compiler(), OSCILLATOR.sources())
    assert time.monotonic() - begin < 1.0
    time.sleep(1.2)
    assert not (fresh / "late").exists()


def test_a_changed_compiler_is_another_one(fresh, monkeypatch):
    mine = script(fresh / "mine", f'exec {REAL} "$@"')
    monkeypatch.setenv("CC", str(mine))
    before = find_compiler()
    os.utime(mine, (1, 1))
    assert find_compiler().identity != before.identity
    assert find_compiler(native=True).identity != find_compiler().identity


def test_code_for_wide_registers_is_not_that_for_narrow_ones(fresh, monkeypatch):
    """A cache that machines share has code for each kind; what other machines run is for all."""
    monkeypatch.setattr(module, "_machine", lambda: ("x86_64",))
    found = dict.fromkeys([(), ("-mavx2",)])
    for wide in found:
        monkeypatch.setattr(module, "_wide_registers", lambda wide=wide: wide)
        found[wide] = find_compiler()
    narrow, wide = found.values()
    assert narrow.identity != wide.identity
    assert narrow.flags == wide.flags
    assert "-mavx2" not in find_compiler(native=True).wide


def test_the_environment_cannot_leave_files_in_the_working_folder(fresh, monkeypatch):
    work = fresh / "work"
    work.mkdir()
    monkeypatch.chdir(work)
    build_library(find_compiler(), OSCILLATOR.sources())
    assert list(work.iterdir()) == []


def test_the_runtime_is_compiled_once_for_all_models(fresh, monkeypatch):
    log = fresh / "log"
    monkeypatch.setenv("CC", str(script(fresh / "logged", f'echo "$@" >> {log}\nexec {REAL} "$@"')))
    sources = OSCILLATOR.sources()
    build_library(find_compiler(), sources)
    build_library(find_compiler(), {**sources, "model.c": sources["model.c"] + "\n"})
    build_library(find_compiler(), sources)
    lines = log.read_text().splitlines()
    assert sum("-c explicit.c" in line for line in lines) == 1
    assert sum("-c model.c" in line for line in lines) == 2


def test_the_runtime_is_compiled_beside_a_derivation(fresh, monkeypatch):
    log = fresh / "log"
    monkeypatch.setenv("CC", str(script(fresh / "logged", f'echo "$@" >> {log}\nexec {REAL} "$@"')))
    sources = OSCILLATOR.sources()
    begin_runtime(find_compiler(), {name: text for name, text in sources.items() if name != "model.c"})
    build_library(find_compiler(), sources)
    assert all(log.read_text().count(f"-c {name}") == 1 for name in sources if name.endswith(".c"))


@pytest.mark.parametrize("text", ["exit 3", "echo 'bad: fatal error: out of paper' >&2; exit 3"])
def test_a_compiler_that_fails_beside_a_derivation_says_nothing(fresh, monkeypatch, capfd, text):
    monkeypatch.setenv("CC", str(script(fresh / "bad", text)))
    begin_runtime(find_compiler(), {name: text for name, text in OSCILLATOR.sources().items() if name != "model.c"})
    for thread in threading.enumerate():
        if thread is not threading.current_thread() and "multibody_sym" in thread.name:
            thread.join()
    assert capfd.readouterr() == ("", "")
    with pytest.raises(CompilerError):
        build_library(find_compiler(), OSCILLATOR.sources())


def test_the_same_source_gives_the_same_library(fresh, monkeypatch):
    first = build_library(find_compiler(), OSCILLATOR.sources())
    monkeypatch.setenv("XDG_CACHE_HOME", str(fresh / "another"))
    second = build_library(find_compiler(), OSCILLATOR.sources())
    assert first != second
    assert first.name == second.name


# --- what is linked ------------------------------------------------------------------------------------------------

LINKING = 'case "$*" in *-shared*) {} ;; esac\nexec {} "$@"'


def test_what_is_about_to_be_linked_may_be_deleted_from_the_cache(fresh, monkeypatch):
    sources = OSCILLATOR.sources()
    build_library(find_compiler(), sources)
    emptied = f"rm -f {cache.folder()}/*"
    monkeypatch.setenv("CC", str(script(fresh / "late", LINKING.format(emptied, REAL))))
    build_library(find_compiler(), sources)
    again = build_library(find_compiler(), {**sources, "model.c": sources["model.c"] + "\n"})
    assert again.exists()


def test_kept_objects_that_cannot_be_linked_are_compiled_once_more(fresh, monkeypatch):
    monkeypatch.setattr(cache, "stored_content", lambda _: b"bad")
    assert build_library(find_compiler(), OSCILLATOR.sources()).exists()


def test_the_reason_is_the_linkers_own_line(fresh, monkeypatch):
    own, summary = "/usr/bin/ld: cannot find ./solve.o: No such file", "collect2: error: ld returned 1 exit status"
    says = f"echo '{own}' >&2; echo '{summary}' >&2; exit 1"
    monkeypatch.setenv("CC", str(script(fresh / "bad", LINKING.format(says, REAL))))
    with pytest.raises(CompilerError, match=r"failed: /usr/bin/ld: cannot find \./solve\.o"):
        build_library(find_compiler(), OSCILLATOR.sources())


def test_the_reason_is_the_linkers_own_line_of_a_real_one(fresh, monkeypatch):
    monkeypatch.setenv("CC", f"{REAL} -Wl,--no-undefined")
    sources = OSCILLATOR.sources()
    sources["model.c"] += "extern int nowhere(void);\nint used(void);\nint used(void) { return nowhere(); }\n"
    with pytest.raises(CompilerError, match=r"failed: .*nowhere"):
        build_library(find_compiler(), sources)


def test_where_the_machine_has_none_that_of_a_package_serves(fresh, monkeypatch, tmp_path):
    cc = find_compiler().command[0]
    zig = tmp_path / "site" / "ziglang" / "zig"
    zig.parent.mkdir(parents=True)
    (zig.parent / "__init__.py").touch()
    script(zig, f'test "$1" = cc && shift && PATH={os.environ["PATH"]!r} exec {cc} "$@"')
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    found = find_compiler()
    assert found.command == (str(zig), "cc")
    assert "-fno-sanitize=undefined" in found.flags
    assert build_library(found, OSCILLATOR.sources()).exists()
    monkeypatch.chdir(tmp_path / "site")
    with pytest.raises(CompilerError, match=r"none of cc, gcc, clang .*'multibody-sym\[compiler\]' brings one"):
        find_compiler()


def test_a_wheel_of_a_platform_brings_the_runtime_compiled(fresh, monkeypatch, tmp_path):
    runtime = {name: text for name, text in OSCILLATOR.sources().items() if name not in ("model.c", "model.h")}
    place = tmp_path / module.BROUGHT
    place.write_bytes(module.objects_to_bring(runtime))
    compiled = []
    run = module._Build._compiling
    monkeypatch.setattr(module._Build, "_compiling", lambda self, units: compiled.append([*units]) or run(self, units))
    monkeypatch.setattr(module, "__file__", str(tmp_path / "compiler.py"))
    assert build_library(find_compiler(), OSCILLATOR.sources()).exists()
    assert compiled == [["model"]]
    changed = {**OSCILLATOR.sources(), "solve.c": runtime["solve.c"] + "\n"}
    assert build_library(find_compiler(), changed).exists()
    assert compiled[1:] == [["model"], ["solve"]]


def test_units_that_take_no_time_of_a_run_are_compiled_with_less_work(fresh, monkeypatch):
    monkeypatch.setattr(module, "_FLAGS", (*module._FLAGS, "-O2"))
    log = fresh / "log"
    monkeypatch.setenv("CC", str(script(fresh / "logged", f'echo "$@" >> {log}\nexec {REAL} "$@" -O0')))  # sooner
    build_library(find_compiler(), OSCILLATOR.sources())
    lines = [line.split() for line in log.read_text().splitlines()]
    told = {words[words.index("-c") + 1]: words for words in lines if "-c" in words}
    assert all("-O2" in words for words in told.values())
    less = {name for name, words in told.items() if words[-5:-4] == ["-O1"]}
    seldom = ("turns", "events", "looks", "switching", "singular", "multistep", "pairing")
    assert less == {f"{unit}.c" for unit in seldom}
    assert {"model.c", "runtime.c", "explicit.c", "stages.c", "solve.c"} <= set(told) - less
