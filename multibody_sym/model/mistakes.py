"""All mistakes of a model at once: after each one a mended copy of the model is read again, until none is left.

Only the first mistake is certain. The copy is mended as its author might do it: with the word that the message
suggests, else a known word, a plain number or a vector, else without the part. A body without a joint gets one.
Errors that follow from a removed or guessed part are left out.

In: the first error, the content of a file, its reader. Out: the first error in the file's order, with the others.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Final

from multibody_sym.errors import InputError, MultibodyError
from multibody_sym.model.system import path_in_file

MOST: Final = 100
_PARTS: Final = 30_000
"""The most parts read again, summed over all readings: large models show fewer mistakes at once."""
_MOST_READINGS: Final = 4 * MOST
_NAME: Final = re.compile(r"[A-Za-z]\w*")
_UNKNOWN_KEY, _UNKNOWN_WORDS, _UNJOINED, _NUMBER = "M101", ("M106", "M107"), ("M110", "M111"), "1"
_NOTHING_JOINS, _NO_CHOICE, _NO_VALUE, _UNIT, _IN_PLANE = "M111", "M104", "M103", "M105", "M114"
_MISSING, _UNKNOWN = "M102", "M106"
_OUT_OF_RANGE: Final = "M109"
_OF_UNITS: Final = (_UNIT, "E106")
_GROUND: Final = "ground"
_INSTEAD: Final[dict[str, Any]] = {
    "axis": "x", "normal": "y", "along": "x", "so": "1 == 1", "table": [["0", "0"], ["1", "1"]]
}
"""Replacements for wrong or missing contents of some keys; other keys get a number."""

_OURS: Final = "put_in_by_mending_"
"""The beginning of added names; messages leave them out."""
_ELEMENT: Final = 2
"""Steps to an element: its section and its name."""
_CHAIN: Final = 3
"""Steps to the body or joint of a chain in a list, at most."""
_VECTOR: Final = 3
_ELEMENTS: Final[dict[str, Any]] = {"bodies": {}, "parameters": _NUMBER}
"""Replacements for elements that others name; for joints see `_without_ends`."""
_ZERO: Final = "0"
"""The replacement of components: a plane model stays plane."""
_ALONG_X: Final = [_NUMBER, _ZERO, _ZERO]

Path = tuple[str, ...]


def with_others(error: MultibodyError, content: Any, read: Callable[[Any], object]) -> MultibodyError:
    """Return the first mistake of a model file's `content`, in the order of the file; it carries the others.

    `error` is one of them, or carries some. `read` raises InputError for the first that it meets, with its path.
    """
    if not isinstance(error, InputError) or not (error.where.path or error.number == _MISSING):
        return error
    copy = _MendedCopy(content)
    readings = min(_MOST_READINGS, 1 + _PARTS // copy.size)
    found = met = _split(error, content)
    while len(found) < MOST and readings and copy.mend_all(met):
        readings -= 1
        try:
            read(copy.content)
            break
        except InputError as next_error:
            met = _split(next_error, content)
        except Exception:  # the copy is no model that anybody wrote: what it meets elsewhere says nothing
            break
        new = [each for each in met if not copy.explains(each)]
        for each in new:
            every, own = (", ".join(names) for names in (each.known, (x for x in each.known if _OURS not in x)))
            if own != every and each.message.endswith(f"; known: {every}"):
                each.message = each.message.removesuffix(f"; known: {every}") + (f"; known: {own}" if own else "")
        found = [*found, *new]
    first, *others = sorted(found, key=lambda each: _place_in(content, each.where.path))
    first.others = tuple(others)
    return first


def _split(error: MultibodyError, content: Any) -> list[MultibodyError]:
    """Return an error and those that it carries as separate errors, with their paths in the content.

    Of a mistake that all copies of a chain repeat, the first is kept.
    """
    every, error.others = [error, *error.others], ()
    found, copied = list[MultibodyError](), set[Path]()
    for each in every:
        path = path_in_file(content, each.where.path)
        if path not in copied:
            found.append(each)
        if path != each.where.path:
            copied.add(path)
            each.where = replace(each.where, path=path)
    return found


def _place_in(content: Any, path: Path) -> tuple[int, ...]:
    """Return the position of a path in the content, by which paths are sorted."""
    place = []
    for step in path:
        if isinstance(content, dict) and step in content:
            place.append(list(content).index(step))
            content = content[step]
        elif isinstance(content, list) and step.isdecimal() and int(step) < len(content):
            place.append(int(step))
            content = content[int(step)]
        else:
            break
    return tuple(place)


class _MendedCopy:
    """A copy of a model's content that loses its mistakes one by one, and remembers which errors follow from that."""

    def __init__(self, content: Any) -> None:
        self.content = _copy(content)
        self.size = _parts(content)
        self._tried: dict[Path, int] = {}
        self._invented: set[Path] = set()
        self._words = {_NUMBER}
        self._guessed: set[tuple[Path, str]] = set()
        self._rejoined: set[Path] = set()
        self._changed: set[str] = set()
        self._emptied: set[str] = set()
        self._unjoined = False
        self._lost = 0
        self._out_of_range: set[str] = set()
        self._unread: set[str] = set()

    def explains(self, error: MultibodyError) -> bool:
        """Return whether an error is about a mended part, or follows from a removed one."""
        if (error.number in _UNJOINED and self._unjoined) or (error.number == _IN_PLANE and self._rejoined):
            return True
        path = self._path(error)
        if error.number == _NOTHING_JOINS and path[:-1] == ("bodies",):
            return path in self._tried or self._lost > 0
        if any(path[: len(invented)] == invented for invented in self._invented):
            return True
        if error.number in _UNKNOWN_WORDS and error.word:
            names = [error.word, *_NAME.findall(error.word), *re.split(r"[._]", error.word)]
            beside = path[-1:] == ("at",)  # a point of the body that stands beside it
            guessed = any(path[:_ELEMENT] == at and (beside or name in names) for at, name in self._guessed)
            return guessed or not (self._words | self._emptied).isdisjoint(names)
        if error.number == _UNKNOWN_KEY:
            return False
        part = _at(self.content, path)
        judged = error.number.startswith("M") and not isinstance(part, dict)  # others are wrong as they are written
        if judged and not self._changed.isdisjoint(_words_in(part)):
            return True
        if error.number == _OUT_OF_RANGE and not self._out_of_range.isdisjoint(self._parameters_in(path)):
            return True
        if error.number in _OF_UNITS and not self._unread.isdisjoint(self._behind(path)):
            return True
        if judged and self._follows_from_guess(error, path):
            return True
        other = (*path[:-1], error.word)  # a mended or removed part beside it
        if error.word and any(mended[: len(path)] == other for mended in self._tried):
            return True
        return any(mended[: len(path)] == path for mended in self._tried)

    def _follows_from_guess(self, error: MultibodyError, path: Path) -> bool:
        """Return whether an element's error follows from a guessed name in it; an error of units, from a joint's."""
        guesses = [name for element, name in self._guessed if element == path[:_ELEMENT]]
        if error.number == _UNIT:
            return not set(guesses).isdisjoint(self.content.get("joints") or ())
        return bool(guesses) and error.number not in (_NO_VALUE, _MISSING, _OUT_OF_RANGE)

    def mend_all(self, errors: Sequence[MultibodyError]) -> bool:
        """Mend the parts with the errors of one reading; return whether there was one."""
        paths = [self._path(each) for each in errors]
        pairs = zip(errors, paths, strict=True)
        mended = [self._mend(each, path) for each, path in pairs if self._path(each) == path]
        return any(mended)

    def _mend(self, error: MultibodyError, path: Path) -> bool:
        """Mend the part with an error; return whether there was one."""
        if error.number == _MISSING and self._add(error, path):
            return True
        if not path:
            return False
        if self._join(error, path):
            return True
        if error.number == _OUT_OF_RANGE:
            self._out_of_range |= self._parameters_in(path)
        if error.number.startswith("E") and path[0] == "parameters":
            self._unread.update(path[1:_ELEMENT])
        above = _at(self.content, path[:-1])
        key: Any = int(path[-1]) if isinstance(above, list) else path[-1]
        better = self._better(error, path, above[key])
        self._tried.setdefault(path, 0)
        if error.number == _UNKNOWN_KEY and better is not None and better not in above:
            above[better] = above.pop(key)
        elif error.number != _UNKNOWN_KEY and better is not None:
            above[key] = better
        else:
            self._drop(path)
        return True

    def _add(self, error: MultibodyError, path: Path) -> bool:
        """Add a missing part; return whether there is a content that was not tried before."""
        above = _at(self.content, path)
        added = error.where.path if len(error.where.path) == len(path) + 1 else (*path, error.word or "")
        if not isinstance(above, dict) or not added[-1] or added[-1] in above:
            return False
        instead = self._next(added, [], None)
        if instead is None:
            return False
        above[added[-1]] = instead
        return True

    def _join(self, error: MultibodyError, path: Path) -> bool:
        """Mend a body without a joint, or a joint with an unknown child; return whether the error is one of these."""
        bodies, joints = (self.content.get(section) for section in ("bodies", "joints"))
        if not isinstance(bodies, dict) or not isinstance(joints or {}, dict) or len(path) < _ELEMENT:
            return False
        if path[0] == "bodies" and error.number in _UNJOINED and path not in self._tried:
            self._tried[path], self._lost = 0, max(self._lost - 1, 0)
            added = f"{_OURS}{len(self._tried)}"
            self.content["joints"] = {**(joints or {}), added: self._free_joint({"child": path[1]})}
            self._invented.add(("joints", added))
            return True
        if path[0] != "joints" or path[_ELEMENT:] != ("child",) or path in self._tried:
            return False
        joint = joints[path[1]]
        kept = [each for each in joints.values() if isinstance(each, dict) and each.get("cut") in (None, "false")]
        children = {str(each.get("child")).partition(".")[0] for each in kept}
        left = next((name for name in bodies if name not in children and name != _GROUND), None)
        if left is not None and error.meant is None and (error.number == _UNKNOWN or joint["child"] == _GROUND):
            self._words.update({error.word or ""} - _declared_names(self.content))
            joint["child"] = left
        elif error.number in _UNJOINED and joint["child"] != _GROUND:
            joint["parent"] = _GROUND
        else:
            return False
        self._tried[path] = 0
        return True

    def _free_joint(self, ends: dict[str, Any]) -> dict[str, Any]:
        """Return a planar joint whose coordinates no model has."""
        q = [f"{_OURS}{len(self._tried)}_{letter}" for letter in "xyz"]
        return {"type": "planar", "parent": _GROUND, **ends, "q": q}

    def _parameters_in(self, path: Path) -> set[str]:
        """Return the parameters in expressions at a path, whose values may be the mistake."""
        return {*_words_in(_at(self.content, path))}.intersection(self.content.get("parameters") or ())

    def _behind(self, path: Path) -> set[str]:
        """Return the parameters on which expressions at a path depend."""
        found, new = set[str](), self._parameters_in(path)
        while new:
            found |= new
            new = {x for name in new for x in self._parameters_in(("parameters", name))} - found
        return found

    def _path(self, error: MultibodyError) -> Path:
        """Return an error's path as far as the content has it."""
        return error.where.path[: len(_place_in(self.content, error.where.path))]

    def _better(self, error: MultibodyError, path: Path, part: Any) -> Any:
        """Return the replacement of a part, None where it is left out."""
        if error.number == _UNKNOWN_KEY:
            return error.meant
        if not isinstance(part, str):
            short = isinstance(part, list) and part and len(part) < _VECTOR and path not in self._tried
            if short:
                self._invented.update((*path, str(k)) for k in range(len(part), _VECTOR))
                return [*part, *[_ZERO] * (_VECTOR - len(part))]
            whole = _ELEMENTS.get(path[0]) if len(path) == _ELEMENT else _INSTEAD.get(path[-1])
            if whole is None:
                return None
            self._words.update({*_words_in(part)} - _declared_names(self.content))
            return self._next(path, [whole], part)
        if error.word and (error.meant or error.number in _UNKNOWN_WORDS):
            if error.meant is None:  # a misspelt word may stand in several places
                self._words.update({error.word} - _declared_names(self.content))
            word = re.compile(rf"(?<!\w){re.escape(error.word)}(?!\w)")
            guess = error.meant or self._guess(error, path)
            changed = word.sub(guess, part)
            if changed != part:
                return changed
        elif _NAME.fullmatch(part) and path not in self._tried:
            self._words.update({part} - _declared_names(self.content))
        if path[-1] == "axis" and path not in self._tried:
            return None
        return self._next(path, [error.meant] if error.meant else self._choices(error, path), part)

    def _choices(self, error: MultibodyError, path: Path) -> Sequence[str]:
        """Return the replacements of a wrong word; for types none, as all other keys depend on them."""
        return error.known[:1] if error.number == _NO_CHOICE and path[-1] != "type" else ()

    def _guess(self, error: MultibodyError, path: Path) -> str:
        """Return the replacement of an unknown word: a known one, a point's body, or a number."""
        if error.number != _UNKNOWN or path in self._tried:
            return _NUMBER
        body, dot, _ = (error.word or "").partition(".")
        carries = bool(dot) and (body == _GROUND or body in (self.content.get("bodies") or ()))
        known = error.known or ((body,) if carries else ())
        if not known:
            return _NUMBER
        guess = _GROUND if _GROUND in known else known[0]
        self._guessed.add((path[:_ELEMENT], guess))
        return guess

    def _next(self, path: Path, first: Sequence[Any], part: Any) -> Any:
        """Return the next replacement of a part that was not tried yet; None after the last."""
        number = _ZERO if path[-1].isdecimal() else _NUMBER
        instead = number if len(path) == _ELEMENT else _INSTEAD.get(path[-1], number)
        kinds = first if isinstance(part, dict) else [*first, instead, _ALONG_X]
        for k in range(self._tried.get(path, 0), len(kinds)):
            self._tried[path] = k + 1
            if kinds[k] != part:
                self._invented.add(path)
                self._change(path)
                return _copy(kinds[k])
        self._tried.setdefault(path, 0)
        return None

    def _drop(self, path: Path) -> None:
        """Remove a part, of a list the whole list, as places in it are paths of others.

        A joint of a known body becomes a planar one.
        """
        while path and isinstance(_at(self.content, path[:-1]), list):
            path = path[:-1]
        if not path:
            return
        above = _at(self.content, path[:-1])
        gone = above.pop(path[-1])
        if path not in self._invented:
            self._change(path)
        if path[0] == "joints" and len(path) == _ELEMENT:
            gone = self._without_ends(path, gone)
        if path not in self._invented:
            self._words.update({path[-1], *_words_in(gone)} - _declared_names(self.content))
        if path[0] != "joints" or len(path) < _ELEMENT:
            self._unjoined |= path in (("joints",), ("bodies",)) or (path[0] == "repeat" and len(path) <= _CHAIN)

    def _without_ends(self, path: Path, gone: Any) -> Any:
        """Put a planar joint with the same ends in the place of a removed one; return the lost contents."""
        if path in self._rejoined or not isinstance(gone, dict) or not isinstance(gone.get("child"), str):
            self._lost += path not in self._rejoined
            return gone
        self._rejoined.add(path)
        ends = {end: gone[end] for end in ("parent", "child") if end in gone}
        _at(self.content, path[:-1])[path[1]] = self._free_joint(ends)
        self._invented.update((*path, key) for key in ("type", "q"))
        return {key: x for key, x in gone.items() if key not in ends}

    def _change(self, path: Path) -> None:
        """Remember that the element of a changed part is no longer certain, nor are its points and frames."""
        self._changed.update(path[1:_ELEMENT])
        if len(path) == _ELEMENT or path[_ELEMENT:] in (("points",), ("frames",), ("surfaces",)):
            self._emptied.add(path[1])


def _declared_names(content: dict[str, Any]) -> set[str]:
    """Return the names that a model declares, with ground."""
    parts = [part for part in content.values() if isinstance(part, dict)]
    return {_GROUND, *(str(name) for part in parts for name in part)}


def _words_in(part: Any) -> list[str]:
    """Return the keys and texts of a part of the content."""
    if isinstance(part, dict):
        return [word for key, x in part.items() for word in (key, *_words_in(x))]
    if isinstance(part, list):
        return [word for x in part for word in _words_in(x)]
    return _NAME.findall(str(part))


def _copy(content: Any) -> Any:
    if isinstance(content, dict):
        return {key: _copy(x) for key, x in content.items()}
    return list(map(_copy, content)) if isinstance(content, list) else content


def _parts(content: Any) -> int:
    if isinstance(content, (dict, list)):
        return 1 + sum(map(_parts, content.values() if isinstance(content, dict) else content))
    return 1


def _at(content: Any, path: Path) -> Any:
    for step in path:
        content = content[int(step)] if isinstance(content, list) else content[step]
    return content
