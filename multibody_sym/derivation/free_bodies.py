"""Every body cut free, in symbols: balances of force and moment in which the joints' reactions are unknown.

    m a_C = F + R - sum R_j,   J alpha + omega x J omega = the moments of the same about the centre of mass

Components are those of the body's own reaction: along the axes of its joint's frame on the parent; moments on a body
that a ball carries are along the body's own axes, which makes them Euler's equations.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import sympy

from multibody_sym.algebra.simplify import Subexpressions
from multibody_sym.derivation.lagrange import known_nodes
from multibody_sym.derivation.notation import Equation, Label, Symbols, latex_name
from multibody_sym.mechanics.forces import applied_forces
from multibody_sym.mechanics.mechanism import Mechanism, TreeBody
from multibody_sym.mechanics.motion import (
    Motion,
    accelerations,
    motion_of,
    partial_velocities,
    pose,
    slot_state,
    spread,
)
from multibody_sym.mechanics.points import Wrench, generalized_forces
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.mechanics.row_records import AngleRow, DistanceRow, GearRow, PositionRow, RopeRow, Row, TurningRow
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.model.steps import is_flat
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import ZERO
from multibody_sym.scalars.vectors import (
    UNIT_MATRIX,
    ZERO_VECTOR,
    Mat,
    S,
    Vec,
    add,
    apply,
    cross,
    dot,
    negate,
    product,
    scale,
    subtract,
    transpose,
)
from multibody_sym.text.printer import COMPONENTS

# ----------------------------------------------------------------------------------------------------------------------
# The letters of unknown forces as a book has them: tensions T, rods S, normal forces N, friction F, A_x and M_A.
#
# In: a Mechanism and the symbols of its forces. Out: a Label for each, and its meaning in words.


TENSION, ROD, NORMAL, FRICTION, TOOTH, MOMENT, SPRING = "T", "S", "N", "F", "Z", "M", "P"
_SHORT: Final = 2
_AXES: Final = "xyz"
_WORDS: Final = {
    TENSION: "tension of", ROD: "force of rod", NORMAL: "normal force at", FRICTION: "friction at",
    TOOTH: "force at the teeth of", MOMENT: "moment at",
}


@dataclass(frozen=True)
class LetteredForce:
    """A force that has a letter: its symbol, the letter, the element that names it where the letter is taken.

    `own` is the letter that the model gives it.
    """

    symbol: Any
    letter: str
    element: str
    own: str = ""


def force_letters(
    mechanism: Mechanism, symbols: Symbols, used: Collection[Any], further: Sequence[LetteredForce] = ()
) -> dict[Any, Label]:
    """Return how the unknown forces that are `used` are spelt; `further` are those that no row and joint has.

    One force of a kind has the letter alone. Several have numbers in the order of the model, friction that of its
    normal force. Where the model itself uses such a name, all of the kind have the letter with the element's name.
    """
    lettered = [*_forces_with_letters(mechanism, symbols), *further]
    joints = {}  # A_x and M_A, also for the rows of cut joints
    for index, body in enumerate(mechanism.bodies):
        for k, component in enumerate(COMPONENTS):
            joints[symbols.reactions[6 * index + k]] = component_label(body.joint_name, component)
    for row, s in zip(mechanism.rows, symbols.multipliers, strict=True):
        joint, dot, rest = row.name.rpartition(".")
        if isinstance(row, (PositionRow, AngleRow)) and dot and rest[-1:] in _AXES:
            joints[s] = component_label(joint, ("m" if isinstance(row, AngleRow) else "f") + rest[-1])
    own = {s: label for s, label in joints.items() if s in used}
    return spell_forces(mechanism, [each for each in lettered if each.symbol in used], own)


def spell_forces(
    mechanism: Mechanism, lettered: Sequence[LetteredForce], joints: Mapping[Any, Label]
) -> dict[Any, Label]:
    """Return how forces are spelt by their symbols, which may be anything: the one place that numbers their letters.

    `joints` are labels of joints' reactions, for those without a letter of their own. No two labels are equal, and
    none is a name of the model.
    """
    declared = (*mechanism.coordinates, *mechanism.speeds, *mechanism.parameters)
    taken = {"t", *mechanism.inputs, *(each.name for each in declared)}
    found: dict[Any, Label] = {}
    found.update((each.symbol, Label(each.own, latex_name(each.own))) for each in lettered if each.own)
    lettered = [each for each in lettered if not each.own]
    order = {each.name: k for k, each in enumerate(mechanism.one_way)}
    lettered.sort(key=lambda each: order.get(each.element, -1))
    pressing: dict[str, str] = {}
    for letter in sorted({each.letter for each in lettered}, key=lambda letter: letter != NORMAL):
        kind = [each for each in lettered if each.letter == letter]
        numbers = [""] if len(kind) == 1 else [str(k + 1) for k in range(len(kind))]
        of_normals = [pressing.get(each.element, "") for each in kind]
        if letter == FRICTION and all(of_normals) and len(set(of_normals)) == len(kind):
            numbers = of_normals
        found.update(_spell_kind(kind, numbers, taken))
        if letter == NORMAL:
            elements = [each.element for each in kind]
            pressing = {name: k for name, k in zip(elements, numbers, strict=True) if elements.count(name) == 1}
    found.update((s, label) for s, label in joints.items() if s not in found)
    unique = {}
    for s, (text, latex) in found.items():
        while text in taken:
            text, latex = text + "_", latex + "{}'"
        taken.add(text)
        unique[s] = Label(text, latex)
    return unique


def describe_forces(mechanism: Mechanism, symbols: Symbols, unknown: Collection[Any]) -> dict[Any, str]:
    """Return what each multiplier, and each reaction among `unknown` ones, is in words."""
    named = {each.symbol: f"{_WORDS[each.letter]} {each.element}" for each in _forces_with_letters(mechanism, symbols)}
    rows = dict(zip(symbols.multipliers, mechanism.rows, strict=True))
    joints = [(body.joint_name, c) for body in mechanism.bodies for c in COMPONENTS]
    reactions = zip(symbols.reactions, joints, strict=True)
    found = {s: named.get(s, f"multiplier of {row.name}") for s, row in rows.items()}
    components = {s: f"component {c} of the reaction of {joint}" for s, (joint, c) in reactions if s in unknown}
    return {**found, **{s: named.get(s, words) for s, words in components.items()}}


def _spell_kind(
    kind: Sequence[LetteredForce], numbers: Sequence[str], taken: Collection[str]
) -> dict[Any, Label]:
    """Return T, or T1, T2 .., or T_string .. for the forces of one kind."""
    letter = kind[0].letter
    if any(letter + number in taken for number in numbers):
        elements = [each.element for each in kind]
        several = [elements[: k + 1].count(name) if elements.count(name) > 1 else "" for k, name in enumerate(elements)]
        return {each.symbol: _with_element(letter, each.element, str(k)) for each, k in zip(kind, several, strict=True)}
    subscripts = [f"_{{{number}}}" if number else "" for number in numbers]
    return {
        each.symbol: Label(letter + number, letter + subscript)
        for each, number, subscript in zip(kind, numbers, subscripts, strict=True)
    }


def _with_element(letter: str, element: str, axis: str = "") -> Label:
    plain = re.sub(r"[^A-Za-z0-9_]+", "_", element)
    words = element.replace("\\", "").replace("_", r"\_")
    under = rf"\mathrm{{{words}}}" if element.isalnum() and len(element) > 1 else words
    if not element.isascii() or re.search(r"[^A-Za-z0-9_]", element):
        under = rf"\text{{{plain}}}".replace("_", r"\_")
    parts = [part for part in (under, axis) if part]
    return Label("_".join(part for part in (letter, plain, axis) if part), f"{letter}_{{{','.join(parts)}}}")


def _forces_with_letters(mechanism: Mechanism, symbols: Symbols) -> Iterable[LetteredForce]:
    """Yield the forces of rows that have a letter, and the normal forces of joints that slide in the plane."""
    elements = row_elements(mechanism)
    for row, s in zip(mechanism.rows, symbols.multipliers, strict=True):
        letter = row_letter(row, mechanism)
        if letter:
            rope = row.plain.rope_run
            name = rope.told[0] if rope is not None else elements.get(row.name, row.name)
            yield LetteredForce(s, letter, name, own_letter(rope) if rope is not None else "")
    for index, body in enumerate(mechanism.bodies):
        across = guide_normal(body)
        if across is not None:
            yield LetteredForce(symbols.reactions[6 * index + across], NORMAL, body.joint_name)


def own_letter(rope: RopeRow) -> str:
    """Return the letter that a model gives the tension of a run of rope, with its number; none for a mean tension."""
    return "" if rope.rubs or not rope.label else f"{rope.label}{rope.run or ''}"


def row_elements(mechanism: Mechanism) -> dict[str, str]:
    """Return for each row of a one-way element the name of the element, or of its part that rubs."""
    found = {row.name: each.name for each in mechanism.one_way for row in each.normals}
    parts = (part for each in mechanism.one_way for part in each.frictions)
    return {**found, **{row.name: part.name for part in parts for row in part.rows}}


def row_letter(row: Row, mechanism: Mechanism) -> str:
    """Return the letter of a row's multiplier, empty where books have none."""
    if isinstance(row, TurningRow):
        return MOMENT
    if row.surfaces is not None:
        return NORMAL if row.is_holonomic else FRICTION
    for element in mechanism.one_way:
        if any(row.name == friction.name for part in element.frictions for friction in part.rows):
            return MOMENT if force_unit(row, mechanism) == "N*m" else FRICTION
        if any(row.name == normal.name for normal in element.normals):
            return TENSION if element.kind == "rope" else NORMAL
    if isinstance(row, PositionRow) and "." not in row.name:  # a point in a plane: others are one of several rows
        return NORMAL
    kinds: dict[type[Row], str] = {RopeRow: TENSION, DistanceRow: ROD, GearRow: TOOTH}
    return next((letter for kind, letter in kinds.items() if isinstance(row, kind)), "")


def force_unit(row: Row, mechanism: Mechanism) -> str:
    """Return the unit of a row's multiplier, whether the row is among the mechanism's or not."""
    return MechanismUnits(replace(mechanism, rows=(row,))).multipliers[row.name]


def guide_normal(body: TreeBody) -> int | None:
    """Return which component of a joint's reaction is normal to the one axis in the plane along which it slides."""
    slides = [axis for step in body.steps for axis in step.slides]
    if len(slides) != 1 or len(body.steps) != 1 or not is_flat(slides[0]):
        return None
    zeros = [k for k in range(2) if slides[0][k] is ZERO]
    return zeros[0] if len(zeros) == 1 else None


def component_label(joint: str, component: str) -> Label:
    """Return A_x for fx of a joint A, M_A for mz and M_A_x for mx; R_hinge_x where the joint has a longer name."""
    turns, axis = component[0] == "m", component[1]
    if turns:
        return _with_element("M", joint, "" if axis == "z" else axis)
    if len(joint) <= _SHORT and joint.isalnum():
        return _with_element(joint, "", axis)
    return _with_element("R", joint, axis)


# ----------------------------------------------------------------------------------------------------------------------
# The balances of each body.


@dataclass(frozen=True)
class FreeBodies:
    """Each body's name and balances; `joints`: what is left of A^T R = Q where a free direction is along no axis.

    `unknown` are the components of reactions that the equations contain; all others vanish or are a drive's.
    """

    names: tuple[str, ...]
    balances: tuple[tuple[Equation, ...], ...]
    joints: tuple[Equation, ...]
    unknown: tuple[Any, ...]

    @property
    def equations(self) -> tuple[Equation, ...]:
        """All equations, body by body."""
        return (*(equation for balances in self.balances for equation in balances), *self.joints)


def free_bodies(mechanism: Mechanism, symbols: Symbols, names: Subexpressions) -> FreeBodies:
    """Return the balances of all bodies; those that say no more than that a reaction vanishes are left out."""
    names.budget.enter("the balances of the bodies")
    motion = motion_of(mechanism, slot_state(mechanism))
    found = _Reactions(motion, symbols, names)
    joints = [equation for index in range(len(motion.bodies)) for equation in found.of_joint(index)]
    inward = [found.of_body(index) for index in reversed(range(len(motion.bodies)))]
    balances = tuple(tuple(balance.equation() for balance in of_body) for of_body in reversed(inward))
    written = {s for group in (*balances, joints) for e in group for s in (e.left + e.right).free_symbols}
    unknown = tuple(s for s in symbols.reactions if s in written)
    return FreeBodies(tuple(body.name for body in mechanism.bodies), balances, tuple(joints), unknown)


@dataclass(frozen=True)
class _Balance:
    """sum inertia[k] udot_k + bias = load + sum forces[s] s, one component, in sympy."""

    inertia: Mapping[Any, Any]
    bias: Any
    load: Any
    forces: Mapping[Any, Any]

    def equation(self) -> Equation:
        return Equation(
            sympy.Add(*(x * a for a, x in self.inertia.items()), self.bias),
            sympy.Add(self.load, *(x * s for s, x in self.forces.items())),
        )

    def knowing(self, known: Mapping[Any, Any]) -> _Balance:
        """Return it with known reactions among the loads."""
        load = sympy.Add(self.load, *(x * known[s] for s, x in self.forces.items() if s in known))
        left = {s: x for s, x in self.forces.items() if s not in known}
        return _Balance(self.inertia, self.bias, load, left)

    @property
    def vanishing(self) -> Any:
        """The one force that the balance makes zero, None where there is more in it."""
        alone = not self.inertia and self.bias == 0 and self.load == 0 and len(self.forces) == 1
        return next(iter(self.forces)) if alone else None


class _Reactions:
    """What is found, from the leaves inward, about the reactions: `known` ones vanish or are the drives of a joint."""

    def __init__(self, motion: Motion, symbols: Symbols, names: Subexpressions) -> None:
        self.known: dict[Any, Any] = {}
        self._motion, self._symbols, self._names = motion, symbols, names
        self._slots = known_nodes(motion.mechanism, symbols)
        self._sums = _Sums(motion, symbols)

    def of_joint(self, index: int) -> Iterator[Equation]:
        """Read off what a joint transmits along its free directions, A^T R = Q; yield what names several components."""
        own = self._symbols.reactions[6 * index : 6 * index + 6]
        freedoms = [(direction, self._drive(*drive)) for direction, *drive in self._sums.drives(index)]
        if self._motion.mechanism.bodies[index].speeds_in_own_axes:
            *freedoms, x, y, z = freedoms
            axes = zip(*(self._written(direction[3:]) for direction, _ in (x, y, z)), strict=True)
            for s, row in zip(own[3:], axes, strict=True):
                self.known[s] = sympy.Add(*(a * drive for a, (_, drive) in zip(row, (x, y, z), strict=True)))
        for direction, force in freedoms:
            along = {s: x for s, x in zip(own, self._written(direction), strict=True) if x != 0 and s not in self.known}
            if len(along) == 1:
                ((s, x),) = along.items()
                self.known[s] = force / x
            elif along:
                yield Equation(sympy.Add(*(x * s for s, x in along.items())), force)

    def _drive(self, load: S, rows: Sequence[S]) -> Any:
        driven, *rates = self._written([load, *rows])
        return sympy.Add(driven, *(x * s for x, s in zip(rates, self._symbols.multipliers, strict=True)))

    def of_body(self, index: int) -> list[_Balance]:
        """Return the balances of one body that say something, and learn which reactions vanish from the others."""
        written = [self._balance(*component) for component in self._sums.components(index)]
        while True:
            balances = [balance.knowing(self.known) for balance in written]
            vanishing = {balance.vanishing for balance in balances} & set(self._symbols.reactions)
            if not vanishing:
                short = [replace(balance, load=self._names.name(balance.load)) for balance in balances]
                return [b for b in short if b.inertia or b.forces or b.bias != 0 or b.load != 0]
            self.known.update(dict.fromkeys(vanishing, sympy.S.Zero))

    def _balance(self, inertia: Mapping[Any, S], bias: S, load: S, forces: Mapping[Any, S]) -> _Balance:
        values = iter(self._written([*inertia.values(), bias, load, *forces.values()]))
        left = {a: next(values) for a in inertia}
        rest = next(values), next(values)
        right = {s: next(values) for s in forces}
        return _Balance(_non_zero(left), *rest, _non_zero(right))

    def _written(self, nodes: Sequence[S]) -> list[Any]:
        return [self._names.name(x) for x in self._names.translated(nodes, self._slots)]


def _non_zero(terms: Mapping[Any, Any]) -> dict[Any, Any]:
    return {s: x for s, x in terms.items() if x != 0}


class _Sums:
    """The terms of all balances over Nodes."""

    def __init__(self, motion: Motion, symbols: Symbols) -> None:
        self._motion, self._symbols = motion, symbols
        self._partials = partial_velocities(motion)
        self._at_rest = accelerations(motion, [0] * len(motion.state.u))
        self._loads = applied_forces(motion)
        self._rows = row_motions(motion)

    def drives(self, index: int) -> Iterator[tuple[list[S], S, list[S]]]:
        """Yield each freedom's direction A (6) in the reaction's axes, and Q of the loads and of each row."""
        body, moved = self._motion.mechanism.bodies[index], self._motion.bodies[index]
        R_FB, point = self._joint_axes(index), self._joint_point(index)
        for k, linear, angular in zip(body.u, moved.linear, moved.angular, strict=True):
            direction = [*apply(R_FB, add(linear, cross(angular, point))), *apply(R_FB, angular)]
            by_rows = [
                0 if row.all_told else row.forces[k] - generalized_forces(self._motion, row.of_body)[k]
                for row in self._rows
            ]
            yield direction, self._loads.of_speed[k], by_rows

    def components(self, index: int) -> Iterator[tuple[dict[Any, S], S, S, dict[Any, S]]]:
        """Yield inertia by acceleration, bias, load, and unknown forces by symbol: three of force, three of moment."""
        mass, (a, alpha) = self._motion.masses[index], self._at_rest[index]
        w = self._motion.bodies[index].w_WB
        turning = add(apply(mass.inertia, alpha), cross(w, apply(mass.inertia, w)))
        bias = scale(mass.mass, add(a, apply(spread(alpha, w), mass.com))), turning
        inertia = {
            self._symbols.accelerations[k]: (scale(mass.mass, add(v, cross(turn, mass.com))), apply(mass.inertia, turn))
            for k, (v, turn) in self._partials[index].items()
        }
        load = self._about_com(index, self._loads.of_body[index])
        forces = {**self._of_children(index), **self._of_rows(index)}
        axes, own = self._axes(index), self._own(index)
        for part in range(2):
            for i in range(3):
                axis = axes[part][i]
                yield (
                    {s: dot(axis, wrench[part]) for s, wrench in inertia.items()},
                    dot(axis, bias[part]),
                    dot(axis, load[part]),
                    {
                        **{s: wrench[part][i] for s, wrench in own.items()},
                        **{s: dot(axis, wrench[part]) for s, wrench in forces.items()},
                    },
                )

    def _axes(self, index: int) -> tuple[Mat, Mat]:
        """Return the axes of forces and of moments, as rows, in the body's axes."""
        R_FB = self._joint_axes(index)
        return R_FB, UNIT_MATRIX if self._motion.mechanism.bodies[index].speeds_in_own_axes else R_FB

    def _own(self, index: int) -> dict[Any, Wrench]:
        """Return each component of the body's own reaction, already along the axes of the balances."""
        own_axes, R_FB = self._motion.mechanism.bodies[index].speeds_in_own_axes, self._joint_axes(index)
        arm = subtract(self._joint_point(index), self._motion.masses[index].com)
        turned, units = (arm, transpose(R_FB)) if own_axes else (apply(R_FB, arm), UNIT_MATRIX)
        columns = transpose(units)
        wrenches: list[Wrench] = [(unit, cross(turned, c)) for unit, c in zip(UNIT_MATRIX, columns, strict=True)]
        return self._named(index, [*wrenches, *((ZERO_VECTOR, c) for c in columns)])

    def _of_children(self, index: int) -> dict[Any, Wrench]:
        found = {}
        for j, (child, moved) in enumerate(zip(self._motion.mechanism.bodies, self._motion.bodies, strict=True)):
            if child.parent != index:
                continue
            point = add(moved.p_PB, apply(moved.R_PB, self._joint_point(j)))
            R_BF, _ = pose(self._motion.state, child.frame_on_parent)
            directions = [negate(direction) for direction in transpose(R_BF)]
            at_point: list[Wrench] = [self._about_com(index, (d, cross(point, d))) for d in directions]
            found.update(self._named(j, [*at_point, *((ZERO_VECTOR, d) for d in directions)]))
        return found

    def _of_rows(self, index: int) -> dict[Any, Wrench]:
        pairs = zip(self._symbols.multipliers, self._rows, strict=True)
        return {s: self._about_com(index, row.of_body[index]) for s, row in pairs}

    def _named(self, index: int, wrenches: Sequence[Wrench]) -> dict[Any, Wrench]:
        first = len(COMPONENTS) * index
        return dict(zip(self._symbols.reactions[first : first + len(COMPONENTS)], wrenches, strict=True))

    def _about_com(self, index: int, wrench: Wrench) -> Wrench:
        return wrench[0], subtract(wrench[1], cross(self._motion.masses[index].com, wrench[0]))

    def _joint_axes(self, index: int) -> Mat:
        R_PF, _ = pose(self._motion.state, self._motion.mechanism.bodies[index].frame_on_parent)
        return product(transpose(R_PF), self._motion.bodies[index].R_PB)

    def _joint_point(self, index: int) -> Vec:
        return pose(self._motion.state, self._motion.mechanism.bodies[index].frame_on_body)[1]
