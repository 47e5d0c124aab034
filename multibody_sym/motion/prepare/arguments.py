"""What a user hands to a compiled function of a system, completed to what its Programs take."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
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
class Replacements:
    """Parameters and inputs that a caller gives in place of declared ones; `parameters` (np,) are used by default."""

    mechanism: Mechanism
    parameters: Floats

    @cached_property
    def declared(self) -> list[int]:
        """The places of the parameters that the model declares."""
        return [k for k, entry in enumerate(self.mechanism.parameters) if entry.source is Source.DECLARED]

    @cached_property
    def inputs(self) -> tuple[str, ...]:
        """The names of the inputs that may be given: those that drive no motion."""
        driving = self.mechanism.driving_inputs
        return tuple(name for name in self.mechanism.inputs if name not in driving)

    def parameter_vector(self, given: Values) -> Floats:
        """Return all parameters (np,): those that depend on given ones follow them.

        Raises InputError for an unknown name, a wrong length and what is no real number, ModelError for masses,
        inertias or radii that no body has.
        """
        if given is None:
            return self.parameters
        values = self._changed(given)
        self._judge(values)
        return values

    def parameter_rows(self, given: Any) -> Floats:
        """Return all parameters (np,) or (n, np) from the declared ones, by name or as vectors of them."""
        if given is None:
            return self.parameters
        if isinstance(given, Mapping):
            return self._named_parameters(given)
        values = array_of("parameters", given, len(self.declared))
        whole = np.broadcast_to(self.parameters, (*values.shape[:-1], len(self.parameters))).copy()
        whole[..., self.declared] = values
        for row in np.unique(whole.reshape(-1, whole.shape[-1]), axis=0):
            self._judge(row)
        return whole

    def _named_parameters(self, given: Mapping[str, ArrayLike]) -> Floats:
        """Return all parameters (np,), or (n, np) where a name has n values; others follow those that are given."""
        numbers = in_si_units(self.mechanism, "parameters", given)
        arrays = {name: array_of(f"parameters[{name!r}]", value, None) for name, value in numbers.items()}
        count = state_count(arrays)
        if count is None:
            return self.parameter_vector({name: float(array) for name, array in arrays.items()})
        columns = np.stack([np.broadcast_to(array, count) for array in arrays.values()], axis=-1)
        rows, places = np.unique(columns, axis=0, return_inverse=True)
        each = [self.parameter_vector(dict(zip(arrays, row, strict=True))) for row in rows.tolist()]
        different = np.array(each).reshape(len(rows), self.parameters.size)
        return different[places.reshape(-1)]

    def input_rows(self, given: Any) -> dict[str, Floats]:
        """Return the inputs that are given, each a number or n of them; with all of them as a vector it is `inputs`."""
        if given is None:
            return {}
        if not isinstance(given, Mapping):
            vector = array_of("inputs", given, len(self.inputs))
            every = len(self.inputs) == len(self.mechanism.inputs)
            return {"inputs": vector} if every else {name: vector[..., k] for k, name in enumerate(self.inputs)}
        self.verify_free(given)
        for name in given:
            if name not in self.inputs:
                raise InputError(f"there is no input {name!r}", number="M106", word=name, known=self.inputs)
        numbers = in_si_units(self.mechanism, "inputs", given)
        return {name: array_of(f"inputs[{name!r}]", value, None) for name, value in numbers.items()}

    def verify_free(self, names: Iterable[str]) -> None:
        """Raise InputError for an input that drives a motion or constraint: these follow its rates too."""
        driving = next((name for name in names if name in self.mechanism.driving_inputs), None)
        if driving is not None:
            raise InputError(
                f"{driving} drives a motion or a constraint, whose rates a number does not give: change its expression"
            )

    def _judge(self, values: Floats) -> None:
        """Raise ModelError where no body has the masses or inertias; values are judged anew when they change."""
        key = values.tobytes()
        if key in self._judged or not np.isfinite(values).all():
            return
        base = self.mechanism.relative or self.mechanism
        by_name = {p.name: x for p, x in zip(self.mechanism.parameters, values.tolist(), strict=True)}
        verify_bodies(self.mechanism, [by_name.get(p.name, 0.0) for p in base.parameters])
        self._judged[:] = [key]

    @cached_property
    def _judged(self) -> list[bytes]:
        return []

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


@dataclass(frozen=True, eq=False)
class Arguments(Replacements):
    """The same beside the compiled Programs of a mechanism, `inputs` among them."""

    compiled: Compiled

    def __repr__(self) -> str:
        return f"<Arguments of {self.mechanism.name}: {len(self.parameters)} parameters>"

    def complete(
        self, t: float, q: ArrayLike, u: ArrayLike, parameters: Values, inputs: Values
    ) -> tuple[float, Floats, Floats, Floats, Floats, Floats]:
        """Return t, q, u, parameters, inputs, modes; parameters that depend on given ones follow them.

        Raises InputError for an unknown name, a wrong length, what is no real number, and for masses, inertias or
        radii that no body has.
        """
        t, values = number("t", t), self.parameter_vector(parameters)
        state = vector("q", q, len(self.mechanism.coordinates)), vector("u", u, len(self.mechanism.speeds))
        return t, *state, values, self._input_vector(inputs, (t, *state, values)), np.empty(0)

    def _input_vector(self, given: Values, state: tuple[float, Floats, Floats, Floats]) -> Floats:
        names = list(self.mechanism.inputs)
        if given is not None and not isinstance(given, Mapping):
            self.verify_free(names)
            return _whole("inputs", names, given)
        self.verify_free(given or ())
        (values,) = self.compiled["inputs"](*state)
        for name, value in in_si_units(self.mechanism, "inputs", given or {}).items():
            if name not in names:
                raise InputError(f"there is no input {name!r}", number="M106", word=name, known=names)
            values[names.index(name)] = number(f"inputs[{name!r}]", value)
        return values


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
