"""Programs: the named set that describes one system in motion."""

from __future__ import annotations

from dataclasses import fields
from typing import Final, Literal

from multibody_sym.program.program import Program
from multibody_sym.program.statements import Array, Output, ProgramError, ShapeError
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass

_INPUTS: Final = ("t", "q", "u", "parameters", "inputs", "modes")
_FURTHER: Final = {"index_2": ("multipliers",), "index_2_by_state": ("multipliers",)}
_PERHAPS: Final = {"events": ("multipliers",)}
_OUTPUTS: Final = {
    "inputs": ("inputs",),
    "state_derivative": ("qdot", "udot", "multipliers", "report"),
    "jacobian": ("jacobian",),
    "project_position": ("phi", "correction"),
    "project_velocity": ("residual", "correction"),
    "missed": ("phi", "residual"),
    "put_back": ("of_q", "of_u"),
    "normalize": ("q", "deviation"),
    "energy": ("kinetic", "potential"),
    "outputs": ("values",),
    "events": ("values",),
    "index_2": ("qdot", "udot", "phi", "residual"),
    "index_2_by_state": ("jacobian",),
    "index_2_by_multipliers": ("jacobian",),
}

Form = Literal["explicit", "multistep", "implicit", "index_2", "impulses"]
"""What a method of integration asks a system for: its derivative, also the Jacobian, or the equations of index 2.

A multistep method asks for what an explicit one does, and is compiled for those that are asked for it. Time stepping
asks for the laws of impulses, and for the motion without contacts, in no mode.
"""


@dataclass(frozen=True)
class Programs:
    """The Programs of one system; each is called by the name of its field.

    All have the inputs t (), q (nq,), u (nu,), parameters (np,), inputs (nw,), modes (nm,), in this order; `inputs` has
    the first four of them only and runs before the others. Outputs:

    - `inputs`: inputs (nw,).
    - `state_derivative`: qdot (nq,), udot (nu,), multipliers (ns,), report (3,), for ns rows.
    - `jacobian`: jacobian (nq + nu, nq + nu) = d(qdot, udot) / d(q, u), through the inputs as well. None where no
      implicit method asks for it.
    - `project_position`: phi (ns,), correction (nq,); q + correction is one mass-weighted Gauss-Newton step. None
      without rows, as is
    - `project_velocity`: residual (ns,), correction (nu,).
    - `missed`: phi (ns,), residual (ns,), what the two before have of the rows without their corrections.
    - `put_back`: of_q (nq,), of_u (nu,), the corrections of both by one factorisation, that of u where that of q leads.
      None without rows, as is `missed`; runs take these two, exported models the two before.
    - `normalize`: q (nq,) with unit quaternions, deviation (). None without quaternions.
    - `energy`: kinetic (), potential ().
    - `outputs`: values (no,).
    - `events`: values (ne,): first the conditions that stop a run, positive where they hold, then what changes its sign
      at kinks of forces and inputs, then those of a mode, which take the multipliers (ns,) as one more input. None
      where there are none.
    - `index_2`: qdot (nq,), udot (nu,), phi (ns,), residual (ns,) of the equations with rows on positions and speeds.
      It has one more input, the multipliers (2 ns,), first those on positions; so has
    - `index_2_by_state`: jacobian (nq + nu + 2 ns, nq + nu), the derivative of those four by (q, u).
    - `index_2_by_multipliers`: jacobian (nq + nu, 2 ns) = d(qdot, udot) / d multipliers. None of the three where no
      implicit method asks for them.

    With rows, the last three parameters are the most rows to be independent, and Baumgarte's alpha and beta.
    Raises ProgramError where a Program has other inputs or outputs, and ShapeError where their sizes disagree.
    """

    inputs: Program
    state_derivative: Program
    project_position: Program | None
    project_velocity: Program | None
    normalize: Program | None
    energy: Program
    outputs: Program
    events: Program | None = None
    jacobian: Program | None = None
    index_2: Program | None = None
    index_2_by_state: Program | None = None
    index_2_by_multipliers: Program | None = None
    missed: Program | None = None
    put_back: Program | None = None

    def __post_init__(self) -> None:
        for name, program in self.as_mapping().items():
            wanted = _INPUTS[:4] if name == "inputs" else _INPUTS + _FURTHER.get(name, ())
            inputs = tuple(a.name for a in program.inputs)
            if program.name != name or inputs not in (wanted, wanted + _PERHAPS.get(name, ())):
                what = f"{name}({', '.join(wanted)})"
                raise ProgramError(f"program {program.name} stands for {what} and has other inputs")
            if tuple(o.name for o in program.outputs) != _OUTPUTS[name]:
                raise ProgramError(f"program {name} must have the outputs {', '.join(_OUTPUTS[name])}")
            sizes = self._sizes(name)
            parts: list[Array | Output] = [*program.inputs, *program.outputs]
            for part in parts:
                if part.shape != sizes[part.name]:
                    raise ShapeError(f"program {name}: {part.name} has the shape {part.shape}, not {sizes[part.name]}")
        if (self.ns > 0) != (self.project_position is not None) or (self.ns > 0) != (self.project_velocity is not None):
            raise ProgramError("project_position and project_velocity belong to systems with rows, and only to them")

    def as_mapping(self) -> dict[str, Program]:
        """Return the Programs there are, by name, in the order of the fields."""
        named = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: program for name, program in named.items() if program is not None}

    def of_runs(self) -> dict[str, Program]:
        """Return by name those that a run takes."""
        left_out = ("project_position", "project_velocity") if self.put_back is not None else ()
        return {name: program for name, program in self.as_mapping().items() if name not in left_out}

    def exported(self) -> dict[str, Program]:
        """Return by name those that an exported model has; its `events` take the inputs of all."""
        found = {name: program for name, program in self.as_mapping().items() if name not in ("missed", "put_back")}
        return found if self.events is None else {**found, "events": self._events_alone(self.events)}

    def _events_alone(self, events: Program) -> Program:
        """Return `events` of a mode with the multipliers that its state derivative has."""
        trace = Trace("events", self.state_derivative.inputs)
        given = [trace[array.name] for array in trace.inputs]
        if len(events.inputs) == len(given):
            return events
        _, _, multipliers, _ = trace.call(self.state_derivative, given)
        (values,) = trace.call(events, [*given, multipliers])
        return trace.finish({"values": ((len(values),), values)})

    @property
    def nq(self) -> int:
        """The number of coordinates."""
        return self.state_derivative.input("q").size

    @property
    def nu(self) -> int:
        """The number of speeds."""
        return self.state_derivative.input("u").size

    @property
    def ns(self) -> int:
        """The number of rows."""
        return len(self.state_derivative.output("multipliers").values)

    @property
    def np(self) -> int:
        """The number of parameters, Baumgarte's among them."""
        return self.state_derivative.input("parameters").size

    @property
    def nw(self) -> int:
        """The number of inputs."""
        return self.state_derivative.input("inputs").size

    @property
    def nm(self) -> int:
        """The number of modes."""
        return self.state_derivative.input("modes").size

    @property
    def no(self) -> int:
        """The number of outputs."""
        return len(self.outputs.output("values").values)

    @property
    def ne(self) -> int:
        """The number of switching functions: conditions that stop a run, and kinks."""
        return len(self.events.output("values").values) if self.events else 0

    def _sizes(self, name: str) -> dict[str, tuple[int, ...]]:
        """Return the shapes of all inputs and outputs of a Program; `correction` is that of its own unknown."""
        q, u, rows = (self.nq,), (self.nu,), (self.ns,)
        given = {"t": (), "q": q, "u": u, "parameters": (self.np,), "inputs": (self.nw,), "modes": (self.nm,)}
        rates = {"qdot": q, "udot": u, "multipliers": rows, "report": (3,), "phi": rows, "residual": rows}
        n, m = self.nq + self.nu, 2 * self.ns
        jacobian = {"index_2_by_state": (n + m, n), "index_2_by_multipliers": (n, m)}.get(name, (n, n))
        if name in _FURTHER:
            rates["multipliers"] = (m,)
        values = (self.ne if name == "events" else self.no,)
        numbers: dict[str, tuple[int, ...]] = {"deviation": (), "kinetic": (), "potential": ()}
        rates |= {"of_q": q, "of_u": u, "correction": q if name == "project_position" else u}
        return {**given, **rates, **numbers, "values": values, "jacobian": jacobian}
