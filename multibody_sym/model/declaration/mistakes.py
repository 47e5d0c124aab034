"""All mistakes of a model at once: after each one the model is read again with that one mended, until none is left.

Only the first mistake is certain. A copy of the content is mended as its author might do it: with the word that the
message suggests, else with a plain number, else without the part. What follows from a part that is gone is no mistake.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Any, Final

from multibody_sym.errors import InputError, MultibodyError

MOST: Final = 100
"""The most mistakes that are looked for."""
_PARTS: Final = 30_000
"""The most parts of a model that are read again, over all readings: large models show fewer mistakes at once."""
_MOST_READINGS: Final = 4 * MOST
_NAME: Final = re.compile(r"[A-Za-z]\w*")
_UNKNOWN_KEY, _UNKNOWN_WORDS, _UNJOINED, _NUMBER = "M101", ("M106", "M107"), ("M110", "M111"), "1"
_MISSING: Final = "M102"
_OUT_OF_RANGE: Final = "M109"
_GROUND: Final = "ground"
_INSTEAD: Final = {"axis": "x", "normal": "y", "along": "x", "so": "1 == 1"}
"""What may stand under some keys in the place of what is wrong there, or missing; elsewhere a number."""

_VECTOR: Final = 3

Path = tuple[str, ...]


def with_others(error: MultibodyError, content: Any, read: Callable[[Any], object]) -> MultibodyError:
    """Return the first mistake of a model file's `content`, in the order of the file, which carries the others.

    `error` is one of them, or carries some; `read` raises InputError for the first that it meets, with its path in the
    content.
    """
    if not isinstance(error, InputError) or not (error.where.path or error.number == _MISSING):
        return error
    copy = _MendedCopy(content)
    readings = min(_MOST_READINGS, 1 + _PARTS // copy.size)
    found = met = _apart(error)
    while len(found) < MOST and readings and copy.mend_all(met):
        readings -= 1
        try:
            read(copy.content)
            break
        except InputError as next_error:
            met = _apart(next_error)
        except Exception:  # the copy is no model that anybody wrote: what it meets elsewhere says nothing
            break
        found = [*found, *(each for each in met if not copy.explains(each))]
    first, *others = sorted(found, key=lambda each: _place_in(content, each.where.path))
    first.others = tuple(others)
    return first


def _apart(error: MultibodyError) -> list[MultibodyError]:
    """Return an error and the others that it carries, each by itself."""
    every, error.others = [error, *error.others], ()
    return every


def _place_in(content: Any, path: Path) -> tuple[int, ...]:
    """Return where a path stands in the content, comparable with others."""
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
    """A copy of a model's content that loses its mistakes one by one, and what that explains."""

    def __init__(self, content: Any) -> None:
        self.content = _copied(content)
        self.size = _parts(content)
        self._paths: set[Path] = set()
        self._words = {_NUMBER}
        self._unjoined = False
        self._out_of_range: set[str] = set()

    def explains(self, error: MultibodyError) -> bool:
        """Return whether an error is about a part that was mended, or follows from one that is gone."""
        if error.number in _UNJOINED and self._unjoined:
            return True
        path = self._path(error)
        if error.number in _UNKNOWN_WORDS and error.word:
            return not self._words.isdisjoint(_names_in(error.word))
        if error.number == _UNKNOWN_KEY:
            return False
        if error.number == _OUT_OF_RANGE and not self._out_of_range.isdisjoint(self._parameters_in(path)):
            return True
        if error.word and (*path[:-1], error.word) in self._paths:  # a part beside it that was mended, or is gone
            return True
        return any(mended[: len(path)] == path for mended in self._paths)

    def mend_all(self, errors: Sequence[MultibodyError]) -> bool:
        """Mend the parts that the errors of one reading are about; return whether there was one."""
        paths = [self._path(each) for each in errors]
        pairs = zip(errors, paths, strict=True)
        mended = [self.mend(each) for each, path in pairs if self._path(each) == path]
        return any(mended)

    def mend(self, error: MultibodyError) -> bool:
        """Mend the part that an error is about; return whether there was one."""
        path = self._path(error)
        if not path and error.number == _MISSING and error.word and error.word not in self.content:
            self.content[error.word] = _NUMBER
            self._paths.add((error.word,))
            return True
        if not path:
            return False
        if error.number == _MISSING and len(error.where.path) == len(path) + 1 and self._add(error.where.path):
            return True
        above = _at(self.content, path[:-1])
        key: Any = int(path[-1]) if isinstance(above, list) else path[-1]
        if error.number == _OUT_OF_RANGE:
            self._out_of_range |= self._parameters_in(path)
        better = self._better(error, path, above[key])
        self._paths.add(path)
        if error.number == _UNKNOWN_KEY and better is not None and better not in above:
            above[better] = above.pop(key)
        elif error.number != _UNKNOWN_KEY and better is not None:
            above[key] = better
        else:
            self._drop(path)
        return True

    def _add(self, path: Path) -> bool:
        """Add what is missing; return whether that was not tried before."""
        above = _at(self.content, path[:-1])
        if path in self._paths or not isinstance(above, dict):
            return False
        above[path[-1]] = _INSTEAD.get(path[-1], _NUMBER)
        self._paths.add(path)
        return True

    def _parameters_in(self, path: Path) -> set[str]:
        """Return the parameters that expressions at a path name: whose value may be what is wrong."""
        return {*_words_in(_at(self.content, path))}.intersection(self.content.get("parameters") or ())

    def _path(self, error: MultibodyError) -> Path:
        """Return the path of what the content holds of the part that an error is about."""
        return error.where.path[: len(_place_in(self.content, error.where.path))]

    def _better(self, error: MultibodyError, path: Path, part: Any) -> Any:
        """Return what may stand in the place of a part, None where it is left out."""
        if error.number == _UNKNOWN_KEY:
            return error.meant
        instead = _INSTEAD.get(path[-1], _NUMBER)
        if not isinstance(part, str):
            short = isinstance(part, list) and part and len(part) < _VECTOR and path not in self._paths
            return [*part, *[_NUMBER] * (_VECTOR - len(part))] if short else None if instead == _NUMBER else instead
        if error.word and (error.meant or error.number in _UNKNOWN_WORDS):
            if error.meant is None:  # else it is misspelt, which may be in several places
                self._words.update({*_names_in(error.word)} - _declared(self.content))
            changed = re.sub(rf"(?<!\w){re.escape(error.word)}(?!\w)", error.meant or _NUMBER, part)
            if changed != part:
                return changed
        if path in self._paths:
            return None if part == instead else instead
        self._words.update({part} - _declared(self.content) if _NAME.fullmatch(part) else [])
        return error.meant or instead

    def _drop(self, path: Path) -> None:
        """Leave out what stands at a path, with the list that it is in: places in lists are paths of others."""
        while path and isinstance(_at(self.content, path[:-1]), list):
            path = path[:-1]
        if path:
            gone = _at(self.content, path[:-1]).pop(path[-1])
            self._words.update({path[-1], *_words_in(gone)} - _declared(self.content))
            self._unjoined |= path[0] in ("joints", "bodies", "repeat")


def _declared(content: dict[str, Any]) -> set[str]:
    """Return the names that a model still declares, ground among them."""
    parts = [part for part in content.values() if isinstance(part, dict)]
    return {_GROUND, *(str(name) for part in parts for name in part)}


def _names_in(text: str) -> list[str]:
    return [text, *_NAME.findall(text), *re.split(r"[._]", text)]


def _words_in(part: Any) -> list[str]:
    """Return the keys and texts of a part of the content."""
    if isinstance(part, dict):
        return [word for key, x in part.items() for word in (key, *_words_in(x))]
    if isinstance(part, list):
        return [word for x in part for word in _words_in(x)]
    return _NAME.findall(str(part))


def _copied(content: Any) -> Any:
    if isinstance(content, dict):
        return {key: _copied(x) for key, x in content.items()}
    return list(map(_copied, content)) if isinstance(content, list) else content


def _parts(content: Any) -> int:
    if isinstance(content, (dict, list)):
        return 1 + sum(map(_parts, content.values() if isinstance(content, dict) else content))
    return 1


def _at(content: Any, path: Path) -> Any:
    for step in path:
        content = content[int(step)] if isinstance(content, list) else content[step]
    return content
