"""What the names in an `impact:` section stand for: points that meet, elements that close, impulses, what begins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from multibody_sym.errors import ModelError, at
from multibody_sym.model.declaration.contacts import ENOUGH
from multibody_sym.model.declaration.impacts import Impact, Impacts
from multibody_sym.model.declaration.steps import is_upright
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.impacts import MeetingRow, SpeedJump, StruckImpacts, meeting_leaf
from multibody_sym.model.mechanism.loads import BodyTorque, Load, PointForce
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.mass import GROUND, Pose, unit_vector
from multibody_sym.model.mechanism.one_way import BOUNDLESS, FrictionPart, OneWay
from multibody_sym.model.mechanism.rows import CutJoint, Row
from multibody_sym.model.resolution.contacts.elements import verify_bodies
from multibody_sym.model.resolution.plane import in_plane
from multibody_sym.model.resolution.references import References
from multibody_sym.model.resolution.surface_tangents import surface_tangents
from multibody_sym.scalars.node import ZERO, Node


def struck_impacts(
    references: References, one_way: Sequence[OneWay], rows: Sequence[Row], cuts: Sequence[CutJoint]
) -> StruckImpacts | None:
    """Return the resolved section of a system; raises ModelError, with the path, for names of nothing that fits."""
    declared = references.system.impact
    if declared is None:
        return None
    found = _Resolved(references, declared, tuple(one_way), tuple(rows), tuple(cuts))
    for name, impact in declared.strikes.items():
        with at(*declared.path(name)):
            found.add(name, impact)
    return found.told()


class _Resolved:
    """The section as it is resolved, one impact after the other."""

    def __init__(
        self,
        references: References,
        declared: Impacts,
        one_way: tuple[OneWay, ...],
        rows: tuple[Row, ...],
        cuts: tuple[CutJoint, ...],
    ) -> None:
        self.references, self.declared, self.one_way, self.rows, self.cuts = references, declared, one_way, rows, cuts
        self.flat = references.plane or in_plane(references.system)
        self.meetings: list[OneWay] = []
        self.contacts: list[str] = []
        self.loads: list[Load] = []
        self.begins: dict[str, tuple[str, ...]] = {}
        self.jumps: list[SpeedJump] = []
        self.restitutions: dict[str, Node] = {}
        self.tangential: dict[str, Node] = {}
        self.paths: dict[str, tuple[str, ...]] = {}

    def told(self) -> StruckImpacts:
        """Return all of it; without any impact everything that is declared and closes strikes."""
        every = None if not self.declared.strikes else tuple(self.contacts)
        return StruckImpacts(
            tuple(self.meetings),
            every,
            tuple(self.loads),
            self.begins,
            tuple(self.jumps),
            self.restitutions,
            self.tangential,
            self.declared.law,
            self.declared.sequence,
            self.paths,
        )

    def add(self, name: str, impact: Impact) -> None:
        """Take up one impact."""
        self.paths[name] = self.declared.path(name)
        if impact.between is not None:
            self.meetings.append(self._meeting(name, impact, impact.between))
        elif impact.contacts is not None:
            self._add_contacts(impact, impact.contacts)
        elif impact.begins is not None:
            self._add_begun(impact.begins)
        elif impact.motion is not None:
            self.jumps.append(self._jump(impact.motion, impact.speed or ZERO))
        else:
            self.loads.append(self._load(name, impact))

    def _along(self, impact: Impact, components: Point) -> tuple[int, Point]:
        """Return the body whose axes carry those of the frame, and a vector along them."""
        return self.references.along(impact.frame or GROUND, components)

    # --- points that meet -----------------------------------------------------------------------------------------

    def _meeting(self, name: str, impact: Impact, between: tuple[str, ...]) -> OneWay:
        """Return two points that meet as an element that holds one way only."""
        with at("between"):
            verify_bodies(between, self.references.system)
        if any(name in (x.name, x.group) for x in self.one_way):
            raise ModelError(f"{name!r} is a contact too, and results tell both by name; rename one", number="M108")
        ends = self.references.pair(between)
        axes, normal = self._along(impact, impact.normal or (ZERO, ZERO, ZERO))
        frame = Marker(impact.frame or GROUND, axes, Pose())
        normal, flat = self._normal(None if impact.normal is None else normal, len(self.meetings))

        def row(word: str, axis: Point, *, closes: bool = False) -> MeetingRow:
            return MeetingRow(f"{name}.{word}", ends, axis, frame, closes)

        given = [x for x in (impact.static, impact.kinetic) if isinstance(x, Node)]
        enough = impact.static == ENOUGH
        frictions: tuple[FrictionPart, ...] = ()
        if enough or given:
            t1, t2 = surface_tangents(normal, flat=flat)
            rows = (row("friction", t1),) if flat else (row("friction1", t1), row("friction2", t2))
            static, kinetic = BOUNDLESS if enough else given[0], given[-1] if given else BOUNDLESS
            frictions = (FrictionPart(name, rows, static, kinetic, enough),)
        return OneWay(
            name,
            "contact",
            (self.paths[name][0], self.paths[name][-1]),
            (row("normal", normal, closes=True),),
            frictions=frictions,
            restitution=ZERO if impact.restitution is None else impact.restitution,
            tangential_restitution=impact.tangential_restitution or ZERO,
            group=name,
        )

    def _normal(self, given: Point | None, number: int) -> tuple[Point, bool]:
        """Return the unit normal, and whether it lies in the plane of a plane model."""
        if given is None:
            x, y, z = (meeting_leaf(number, k) for k in range(3))
            return unit_vector((x, y, ZERO if self.flat else z)), self.flat
        normal = unit_vector(given)
        if self.flat and is_upright(normal):
            with at("normal"):
                raise ModelError(
                    "the normal leads out of the plane in which everything here moves; nothing strikes so",
                    number="M121",
                )
        return normal, self.flat and normal[2] is ZERO

    # --- declared elements ----------------------------------------------------------------------------------------

    def _add_contacts(self, impact: Impact, names: tuple[str, ...]) -> None:
        unilateral = [element for element in self.one_way if element.unilateral]
        known = list(dict.fromkeys(x for each in unilateral for x in (each.name, each.group) if x))
        for k, name in enumerate(names):
            if name not in known:
                with at("contacts", k):
                    raise ModelError(
                        f"{name!r} is no contact, rope that may slacken or stop", number="M106", word=name, known=known
                    )
            self.contacts.append(name)
            if impact.restitution is not None:
                self.restitutions[name] = impact.restitution
            if impact.tangential_restitution is not None:
                if not any(x.frictions for x in unilateral if name in (x.name, x.group)):
                    with at("tangential_restitution"):
                        raise ModelError(
                            f"{name} is smooth and stores nothing to give back; give it static or kinetic",
                            number="M121",
                        )
                self.tangential[name] = impact.tangential_restitution

    def _add_begun(self, names: tuple[str, ...]) -> None:
        rows: dict[str, list[str]] = {}
        for row in self.rows:
            rows.setdefault(row.name.partition(".")[0], []).append(row.name)
        cut: Mapping[str, CutJoint] = {x.name: x for x in self.cuts}
        for k, name in enumerate(names):
            if name in cut:
                self.begins[name] = tuple(self.rows[i].name for i in cut[name].rows)
            elif name in self.references.system.constraints and name in rows:
                self.begins[name] = tuple(rows[name])
            else:
                with at("begins", k):
                    raise self._not_begun(name, [*cut, *rows])

    def _not_begun(self, name: str, known: Sequence[str]) -> ModelError:
        """Return why something cannot begin."""
        if name in self.references.system.joints:
            told = f"joint {name!r} carries its child, which has no coordinates without it; mark it cut: true"
            return ModelError(told, number="M121")
        if any(name in (x.name, x.group) for x in self.one_way):
            return ModelError(f"{name!r} holds one way only; write contacts: [{name}]", number="M121")
        return ModelError(f"{name!r} is no joint that is cut and no constraint", number="M121", word=name, known=known)

    def _jump(self, name: str, by: Node) -> SpeedJump:
        with at("motion"):
            joint = self.references.system.joints.get(name)
            if joint is not None and getattr(joint, "motion", None) is not None:
                return SpeedJump(name, name, "", by)
            if joint is None and any(row.name == name for row in self.rows):
                return SpeedJump(name, "", name, by)
            known = [x for x, j in self.references.system.joints.items() if getattr(j, "motion", None) is not None]
            known += [row.name for row in self.rows]
            raise ModelError(f"{name!r} is no prescribed motion", number="M106", word=name, known=known)

    # --- given impulses -------------------------------------------------------------------------------------------

    def _load(self, name: str, impact: Impact) -> Load:
        if impact.impulse is not None:
            with at("at"):
                marker = self.references.marker(impact.at or "")
                self._verify_moves(marker.body)
            axes, impulse = self._along(impact, impact.impulse)
            return PointForce(name, marker, impulse, axes)
        with at("on"):
            body = self.references.marker(impact.on or "").body
            self._verify_moves(body)
            self.references.verify_turns(body)
        axes, couple = self._along(impact, impact.couple or (ZERO, ZERO, ZERO))
        return BodyTorque(name, body, couple, axes)

    def _verify_moves(self, body: int) -> None:
        if body < 0:
            raise ModelError("ground does not move, whatever strikes it; name a body", number="M121")


