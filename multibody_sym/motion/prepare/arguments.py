"""What a user hands to a compiled function of a system, completed to what its Programs take."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from multibody_sym.dynamics.start.number_checks import verify_bodies
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.errors import InputError, at, short_repr
from multibody_sym.mechanics.mechanism import Mechanism, Source
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.model.fields import scalar
from multibody_sym.program.loading import Compiled
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.numbers import floats, number, vector

Values = Mapping[str, float] | ArrayLike | None
"""Values by name in place of the system's, all of them as a vector, or None for the system's."""


@dataclass(frozen=True, eq=False)
class Arguments:
    """The mechanism, its compiled Programs (`inputs` among them) and the parameter vector (np,) used by default."""

    mechanism: Mechanism
    compiled: Compiled
    parameters: Floats
    _judged: list[bytes] = field(default_factory=list, compare=False, repr=False)

    def __repr__(self) -> str:
        return f"<Arguments of {self.mechanism.name}: {len(self.parameters)} parameters>"

    def complete(
        self, t: float, q: ArrayLike, u: ArrayLike, parameters: Values, inputs: Values
    ) -> tuple[float, Floats, Floats, Floats, Floats, Floats]:
        """Return t, q, u, parameters, inputs, modes; parameters that depend on given ones follow them.

        Raises InputError for an unknown name, a wrong length, what is no real number, and for masses, inertias or
        radii that no body has.
        """
        t, values = number("t", t), self._parameter_vector(parameters)
        state = vector("q", q, len(self.mechanism.coordinates)), vector("u", u, len(self.mechanism.speeds))
        return t, *state, values, self._input_vector(inputs, (t, *state, values)), np.empty(0)

    def _parameter_vector(self, given: Values) -> Floats:
        if given is None:
            return self.parameters
        values = self._changed(given)
        self._judge(values)
        return values

    def _judge(self, values: Floats) -> None:
        """Raise ModelError where no body has the masses or inertias; values are judged anew when they change."""
        key = values.tobytes()
        if key in self._judged or not np.isfinite(values).all():
            return
        base = self.mechanism.relative or self.mechanism
        by_name = {p.name: x for p, x in zip(self.mechanism.parameters, values.tolist(), strict=True)}
        verify_bodies(self.mechanism, [by_name.get(p.name, 0.0) for p in base.parameters])
        self._judged[:] = [key]

    def _changed(self, given: Mapping[str, float] | ArrayLike) -> Floats:
        if not isinstance(given, Mapping):
            return self._whole_vector(given)
        given = in_si_units(self.mechanism, "parameters", given)
        real = {name: number(f"parameters[{name!r}]", value) for name, value in given.items()}
        values = np.array(parameter_values(self.mechanism, real))
        undeclared = self.mechanism.parameters.places_from(Source.MEASURED, Source.CHOSEN)
        values[undeclared] = self.parameters[undeclared]
        return values

    def _whole_vector(self, given: ArrayLike) -> Floats:
        """Return all parameters from those that have names, or from these with the constant part behind them."""
        entries = self.mechanism.parameters
        names = [p.name for p in entries if p.source is not Source.LITERAL]
        if len(names) == len(entries) or np.shape(given) == (len(entries),):
            return _whole("parameters", [p.name for p in entries], given)
        return np.concatenate([_whole("parameters", names, given), self.parameters[len(names) :]])

    def _input_vector(self, given: Values, state: tuple[float, Floats, Floats, Floats]) -> Floats:
        names = list(self.mechanism.inputs)
        if given is not None and not isinstance(given, Mapping):
            self._verify_free(names)
            return _whole("inputs", names, given)
        self._verify_free(given or ())
        (values,) = self.compiled["inputs"](*state)
        for name, value in in_si_units(self.mechanism, "inputs", given or {}).items():
            if name not in names:
                raise InputError(f"there is no input {name!r}", number="M106", word=name, known=names)
            values[names.index(name)] = number(f"inputs[{name!r}]", value)
        return values

    def _verify_free(self, names: Iterable[str]) -> None:
        """Raise InputError for an input that drives a motion or constraint: these follow its rates too."""
        driving = next((name for name in names if name in self.mechanism.driving_inputs), None)
        if driving is not None:
            raise InputError(
                f"{driving} drives a motion or a constraint, whose rates a number does not give: change its expression"
            )


def in_si_units(
    mechanism: Mechanism, kind: Literal["parameters", "inputs"], given: Mapping[str, Any]
) -> Mapping[str, Any]:
    """Return values by name with text such as `300 g` as a number in SI units.

    Raises InputError for another dimension, and for an expression of what has no value here.
    """
    if not any(isinstance(value, str) for value in given.values()):
        return given
    units, found = getattr(MechanismUnits(mechanism), kind), dict(given)
    for name, value in given.items():
        if isinstance(value, str) and name in units:
            with at(kind, name):
                node = scalar(value, units[name] or None)
                if node.shadow is None:
                    raise InputError(f"{short_repr(value)} is no number: an expression has no value here")
                found[name] = node.shadow
    return found


def _whole(kind: str, names: list[str], given: ArrayLike) -> Floats:
    values = floats(kind, given)
    if values.shape != (len(names),):
        raise InputError(f"there are {len(names)} {kind} ({', '.join(names)}), got the shape {values.shape}")
    return values


# ----------------------------------------------------------------------------------------------------------------------
# Arrays of one state, or of n.


def array_of(name: str, value: ArrayLike, size: int | None) -> Floats:
    """Return a vector of `size`, or n of them; a number, or n of them, where the size is None."""
    own = 0 if size is None else 1
    values = np.asarray(floats(name, value), order="C")
    if values.ndim not in (own, own + 1) or (size is not None and values.shape[-1] != size):
        wanted = "() or (n,)" if size is None else f"({size},) or (n, {size})"
        raise InputError(f"{name} has the shape {values.shape}, not {wanted}")
    return values


def share_memory(outputs: Sequence[Floats], given: Sequence[Floats]) -> bool:
    """Return whether an output shares memory with another one, or with an argument."""
    others = [*outputs, *given]
    return any(np.may_share_memory(x, y) for k, x in enumerate(outputs) for y in others[k + 1 :])


_VECTORS: Final = ("q", "u", "udot", "parameters", "inputs")


def state_count(arrays: Mapping[str, Floats]) -> int | None:
    """Return n, or None for one state. Raises InputError where arrays disagree."""
    lengths = {name: len(x) for name, x in arrays.items() if x.ndim == (2 if name in _VECTORS else 1)}
    if len(set(lengths.values())) > 1:
        raise InputError(f"arguments have different numbers of states: {lengths}")
    return next(iter(lengths.values()), None)
