"""Classes that are completed when they are used are those that the standard library makes at once."""

from __future__ import annotations

import copy
import dataclasses
import gc
import inspect
import pickle
import subprocess
import sys
from dataclasses import FrozenInstanceError, field, fields, is_dataclass, replace
from threading import Barrier, Thread

import pytest

from multibody_sym.records import dataclass


def _pair(decorator):
    """Return a class and one that inherits it, made by a decorator."""

    @decorator(frozen=True)
    class Base:
        """A base."""

        a: int
        b: tuple = field(default=(), compare=False)

    @decorator(frozen=True, kw_only=True)
    class Derived(Base):
        """Derived."""

        c: list = field(default_factory=list)

        def __post_init__(self):
            object.__setattr__(self, "doubled", 2 * self.a)

    return Base, Derived


@dataclass(frozen=True)
class Pickled:
    """What another process unpickles before it made one."""

    x: int
    y: str = "y"


@pytest.mark.parametrize("base_first", [True, False])
def test_what_is_made_is_what_the_standard_library_makes(base_first):
    for index in (0, 1) if base_first else (1, 0):
        ours, theirs = _pair(dataclass)[index], _pair(dataclasses.dataclass)[index]
        given = {} if index == 0 else {"c": [5]}
        assert repr(ours(3, **given)) == repr(theirs(3, **given))
        assert str(inspect.signature(ours)) == str(inspect.signature(theirs))
        assert [f.name for f in fields(ours)] == [f.name for f in fields(theirs)]
        assert ours.__match_args__ == theirs.__match_args__
        assert vars(ours).keys() - {"__annotations__"} == vars(theirs).keys() - {"__annotations__"}


def test_equal_hashed_frozen_and_replaced():
    base, derived = _pair(dataclass)
    assert base(1, (2,)) == base(1, (3,))
    assert base(1) != derived(1)
    assert hash(base(1, (2,))) == hash(base(1))
    assert replace(derived(1), a=4).doubled == 8
    assert derived(1).c is not derived(1).c
    with pytest.raises(FrozenInstanceError):
        base(1).a = 2
    with pytest.raises(TypeError, match="missing 1 required positional argument: 'a'"):
        base()


@pytest.mark.parametrize("look", [is_dataclass, fields, inspect.signature])
def test_a_class_is_complete_where_it_is_looked_at(look):
    _, derived = _pair(dataclass)
    assert look(derived)
    assert "__eq__" in vars(derived)


def test_plain_classes_inherit_what_is_completed_later():
    base, _ = _pair(dataclass)

    class Plain(base):
        def __init__(self, a):
            super().__init__(a + 1)

    class Bare(base):
        pass

    assert (Plain(1).a, Bare(2).a) == (2, 2)
    assert (Plain(3).a, Bare(4)) == (4, Bare(4))


def test_what_completes_a_class_is_not_found_among_its_subclasses():
    @dataclass(frozen=True)
    class Base:
        size: int

    gc.disable()
    try:
        assert Base(1).size == 1
        assert [one for one in Base.__subclasses__() if one.__module__ != "dataclasses"] == []
    finally:
        gc.enable()


def test_unpickled_before_the_first_is_made():
    given = pickle.dumps(Pickled(3))
    read = "import pickle, sys; one, two = (pickle.loads(%r) for _ in '12'); assert one == two != None; print(one)"
    folder = __file__.rpartition("/")[0]
    words = [sys.executable, "-c", f"import sys; sys.path.insert(0, {folder!r}); {read % given}"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.stdout == "Pickled(x=3, y='y')\n", done.stderr
    assert copy.deepcopy(Pickled(4)) == Pickled(4)


def test_completed_by_several_threads_at_once():
    base, derived = _pair(dataclass)
    barrier, made = Barrier(8), []

    def make(kind):
        barrier.wait()
        made.append(kind(1))

    threads = [Thread(target=make, args=(kind,)) for kind in (base, derived) * 4]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert {repr(one) for one in made} == {repr(base(1)), repr(derived(1))}
    assert len(made) == 8
