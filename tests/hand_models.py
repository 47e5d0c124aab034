"""Small models written by hand in C, with the interface of generated ones."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from multibody_sym.program.loading import Compiled, load_c
from multibody_sym.program.native import Signature
from multibody_sym.program.target_layout import runtime_files

TEMPLATES = Path(__file__).parents[1] / "templates" / "c"

PREAMBLE = """
#include "runtime.h"
#include <math.h>
#define t (in[0][0])
#define q (in[1])
#define u (in[2])
#define p (in[3])
#define w (in[4])
"""


@dataclass(frozen=True)
class HandModel:
    """Sizes and the C bodies of the programs; outputs are out[0], out[1], ..."""

    nq: int
    nu: int
    np: int
    state_derivative: str
    ns: int = 0
    nw: int = 0
    ng: int = 0
    others: tuple[tuple[str, str], ...] = ()

    def signatures(self) -> list[Signature]:
        return [self.signature(name) for name, _ in self.programs()]

    def programs(self) -> list[tuple[str, str]]:
        no_report = "" if self.ns else "\n    out[3][0] = out[3][1] = out[3][2] = 0.0;"
        return [("state_derivative", self.state_derivative + no_report), *self.others]

    def signature(self, name: str) -> Signature:
        inputs = (("t", ()), ("q", (self.nq,)), ("u", (self.nu,)), ("parameters", (self.np,)))
        if name != "inputs":
            inputs = (*inputs, ("inputs", (self.nw,)), ("modes", (0,)))
        outputs = {
            "inputs": (("inputs", (self.nw,)),),
            "state_derivative": (
                ("qdot", (self.nq,)),
                ("udot", (self.nu,)),
                ("multipliers", (self.ns,)),
                ("report", (3,)),
            ),
            "project_position": (("phi", (self.ns,)), ("correction", (self.nq,))),
            "project_velocity": (("residual", (self.ns,)), ("correction", (self.nu,))),
            "normalize": (("q", (self.nq,)), ("deviation", ())),
            "events": (("values", (self.ng,)),),
            "jacobian": (("jacobian", (self.nq + self.nu, self.nq + self.nu)),),
        }
        return Signature(name, inputs, outputs[name])

    def sources(self) -> dict[str, str]:
        lines, entries = [PREAMBLE], []
        for name, body in self.programs():
            signature = self.signature(name)
            lines.append(f"static void {name}(const double *const *in, double *const *out)\n{{\n{body}\n}}\n")
            for side in ("inputs", "outputs"):
                sizes = ", ".join(map(str, signature.sizes(side)))
                lines.append(f"static const int {name}_{side}[] = {{{sizes}}};\n")
            counts = f"{len(signature.inputs)}, {name}_inputs, {len(signature.outputs)}, {name}_outputs"
            entries.append(f'    {{"{name}", {counts}, {name}}}')
        lines.append("const mbs_program mbs_programs[] = {\n" + ",\n".join(entries) + "\n};\n")
        lines.append(f"const int mbs_program_count = {len(entries)};\n")
        return {"model.c": "".join(lines), **runtime_files()}

    def load(self) -> Compiled:
        """Return the model compiled, under a key made of its source."""
        return load_c(self.signatures(), self.sources()["model.c"], self.sources)


OSCILLATOR = HandModel(1, 1, 1, "out[0][0] = u[0]; out[1][0] = -p[0]*p[0]*q[0];")
PENDULUM = HandModel(
    1,
    1,
    2,
    "out[0][0] = u[0]; out[1][0] = -p[0]/p[1]*sin(q[0]);",
    others=(("jacobian", "out[0][0] = out[0][3] = 0.0; out[0][1] = 1.0; out[0][2] = -p[0]/p[1]*cos(q[0]);"),),
)

DOUBLE_PENDULUM = HandModel(
    2,
    2,
    1,
    """
    double s = sin(q[0] - q[1]), c = cos(q[0] - q[1]), determinant = 2.0 - c*c;
    double f0 = -s*u[1]*u[1] - 2.0*p[0]*sin(q[0]), f1 = s*u[0]*u[0] - p[0]*sin(q[1]);
    out[0][0] = u[0];
    out[0][1] = u[1];
    out[1][0] = (f0 - c*f1)/determinant;
    out[1][1] = (2.0*f1 - c*f0)/determinant;
""",
)


def planar_pendulum(*, copies: int = 1, offset: float = 0.0, stabilised: bool = False) -> HandModel:
    """Return a unit mass in x, y (y down is negative) on `copies` equal distance rows |q| = p[1]; gravity p[0].

    `offset`: the second row asks for |q| = p[1] + offset t^3/6 and so contradicts the first.
    """
    ns = copies
    damping = "- 2.0*p[2]*velocity - p[3]*p[3]*(d - p[1])" if stabilised else ""
    setup = f"""
    double d = sqrt(q[0]*q[0] + q[1]*q[1]), n[2] = {{q[0]/d, q[1]/d}};
    double velocity = n[0]*u[0] + n[1]*u[1];
    static const mbs_span spans[] = {{{"{0, 2, 0, 2}, " * ns}}};
    static const mbs_pattern pattern = {{{ns}, 2, spans}};
    double rows[{2 * ns}], right[{ns}], multipliers[{ns}], report[3], factors[MBS_FACTORS({ns}, 2)];
    for (int i = 0; i < {ns}; ++i) {{ rows[2*i] = n[0]; rows[2*i + 1] = n[1]; }}
    mbs_factorise(&pattern, rows, {ns}, factors);
"""
    derivative = f"""{setup}
    double gamma = -(u[0]*u[0] + u[1]*u[1] - velocity*velocity)/d {damping};
    for (int i = 0; i < {ns}; ++i) right[i] = gamma + n[1]*p[0] + (i ? {offset!r} : 0.0)*t;
    mbs_substitute(&pattern, factors, right, out[1], out[2], out[3]);
    out[0][0] = u[0];
    out[0][1] = u[1];
    out[1][1] -= p[0];
"""
    position = f"""{setup}
    for (int i = 0; i < {ns}; ++i) {{ out[0][i] = d - p[1] - (i ? {offset!r} : 0.0)*t*t*t/6.0; right[i] = -out[0][i]; }}
    mbs_substitute(&pattern, factors, right, out[1], multipliers, report);
    (void)velocity;
"""
    speed = f"""{setup}
    for (int i = 0; i < {ns}; ++i) {{ out[0][i] = velocity - (i ? {offset!r} : 0.0)*t*t/2.0; right[i] = -out[0][i]; }}
    mbs_substitute(&pattern, factors, right, out[1], multipliers, report);
"""
    return HandModel(2, 2, 4, derivative, ns=ns, others=(("project_position", position), ("project_velocity", speed)))


ROTATION = HandModel(
    4,
    3,
    3,
    """
    for (int i = 0; i < 1; ++i) {
        out[0][0] = 0.5*(-q[1]*u[0] - q[2]*u[1] - q[3]*u[2]);
        out[0][1] = 0.5*(q[0]*u[0] + q[2]*u[2] - q[3]*u[1]);
        out[0][2] = 0.5*(q[0]*u[1] + q[3]*u[0] - q[1]*u[2]);
        out[0][3] = 0.5*(q[0]*u[2] + q[1]*u[1] - q[2]*u[0]);
    }
    out[1][0] = (p[1] - p[2])/p[0]*u[1]*u[2];
    out[1][1] = (p[2] - p[0])/p[1]*u[2]*u[0];
    out[1][2] = (p[0] - p[1])/p[2]*u[0]*u[1];
""",
    others=(
        (
            "normalize",
            """
    double length = sqrt(q[0]*q[0] + q[1]*q[1] + q[2]*q[2] + q[3]*q[3]);
    for (int i = 0; i < 4; ++i) out[0][i] = q[i]/length;
    out[1][0] = fabs(length - 1.0);
""",
        ),
    ),
)

DRIVEN = HandModel(
    1,
    1,
    1,
    "out[0][0] = u[0]; out[1][0] = w[0] - q[0];",
    nw=1,
    others=(("inputs", "out[0][0] = p[0]*cos(2.0*t);"),),
)
BLOW_UP = HandModel(1, 1, 0, "out[0][0] = u[0]; out[1][0] = 2.0*q[0]*u[0];")  # q' = q^2 if u = q^2
ROOT = HandModel(1, 1, 0, "out[0][0] = 1.0; out[1][0] = sqrt(1.0 - q[0]);")

# a ball over a floor at q = p[1]; switching functions: it touches the floor, it falls, time p[2] has come
BALL = HandModel(
    1,
    1,
    3,
    "out[0][0] = u[0]; out[1][0] = -p[0];",
    ng=3,
    others=(("events", "out[0][0] = p[1] - q[0]; out[0][1] = -u[0]; out[0][2] = t - p[2];"),),
)
# dry friction: a unit mass on a spring that a force of p[0] brakes; the sign of the speed is a kink
BRAKED = HandModel(
    1,
    1,
    1,
    "out[0][0] = u[0]; out[1][0] = -q[0] - (u[0] > 0.0 ? p[0] : -p[0]);",
    ng=1,
    others=(("events", "out[0][0] = u[0];"),),
)
# a unit mass that a force p[0] pushes between the times p[1] and p[2], and another beyond the place p[3]
PUSHED = HandModel(
    1,
    1,
    4,
    "out[0][0] = u[0]; out[1][0] = (t < p[1] || t >= p[2] ? 0.0 : p[0]) + (q[0] < p[3] ? 0.0 : p[0]);",
    ng=3,
    others=(
        ("events", "out[0][0] = t - p[1]; out[0][1] = t - p[2]; out[0][2] = q[0] - p[3];"),
        ("jacobian", "out[0][0] = out[0][2] = out[0][3] = 0.0; out[0][1] = 1.0;"),
    ),
)
