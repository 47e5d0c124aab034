"""Problems that textbooks like, as model files, with what the books print: accelerations, tensions, reactions."""

from __future__ import annotations

from typing import NamedTuple

HEAD = "multibody_sym: 1\nname: problem\n"


class Problem(NamedTuple):
    """A model file's content below its head, the printed formulas by `what.which`, and parameters that may vary."""

    model: str
    printed: dict[str, str]
    vary: str


MOVABLE_PULLEY = Problem(
    """
gravity: [0, -g, 0]
parameters:
  m1: {value: 3 kg, positive: true}
  m2: {value: 2 kg, positive: true}
  g: {value: 10, positive: true}
bodies:
  ground: {points: {hook: [0, 0, 0]}}
  carrier: {mass: m1}
  load: {mass: m2}
pulleys: {fixed: {at: ground}, movable: {at: carrier}}
joints:
  a: {type: prismatic, parent: ground, child: carrier, axis: -y, q: y1, initial: {q: 3}}
  b: {type: prismatic, parent: ground, child: load, axis: -y, q: y2, initial: {q: 2}}
constraints: {string: {type: rope, path: [ground.hook, movable, fixed, load]}}
""",
    {
        "accelerations.y1": "g*(m1 - 2*m2)/(m1 + 4*m2)",
        "accelerations.y2": "2*g*(2*m2 - m1)/(m1 + 4*m2)",
        "string.tension": "3*g*m1*m2/(m1 + 4*m2)",
    },
    "m1 m2 g",
)

DOUBLE_ATWOOD = Problem(
    """
gravity: [0, -g, 0]
parameters: {m1: 3 kg, m2: 2 kg, m3: 1 kg, g: 10}
bodies: {b1: {mass: m1}, b2: {mass: m2}, b3: {mass: m3}, block: {}}
pulleys: {fixed: {at: ground}, movable: {at: block}}
joints:
  a: {type: prismatic, parent: ground, child: b1, axis: -y, q: y1, initial: {q: 2}}
  p: {type: prismatic, parent: ground, child: block, axis: -y, q: y0, initial: {q: 2}}
  b: {type: prismatic, parent: ground, child: b2, axis: -y, q: y2, initial: {q: 5}}
  c: {type: prismatic, parent: ground, child: b3, axis: -y, q: y3, initial: {q: 5}}
constraints: {long: {type: rope, path: [b1, fixed, block]}, short: {type: rope, path: [b2, movable, b3]}}
""",
    {
        "accelerations.y1": "g*(m1*(m2 + m3) - 4*m2*m3)/(m1*(m2 + m3) + 4*m2*m3)",
        "long.tension": "8*g*m1*m2*m3/(m1*(m2 + m3) + 4*m2*m3)",
        "short.tension": "4*g*m1*m2*m3/(m1*(m2 + m3) + 4*m2*m3)",
    },
    "m1 m2 m3 g",
)

TWO_MOVABLE_PULLEYS = Problem(
    """
gravity: [0, -g, 0]
parameters: {m1: 5 kg, m2: 3 kg, m3: 2 kg, g: 10}
bodies: {left: {mass: m1}, right: {mass: m2}, middle: {mass: m3}, ground: {points: {hook: [0, 0, 0]}}}
pulleys: {fixed: {at: ground}, one: {at: left}, two: {at: middle}}
joints:
  a: {type: prismatic, parent: ground, child: left, axis: -y, q: y1, initial: {q: 2}}
  b: {type: prismatic, parent: ground, child: right, axis: -y, q: y2, initial: {q: 3}}
  c: {type: prismatic, parent: ground, child: middle, axis: -y, q: y3, initial: {q: 2}}
constraints: {string: {type: rope, path: [ground.hook, one, fixed, two, ground.hook]},
              line: {type: rope, path: [middle, right]}}
""",
    {
        "accelerations.y1": "g*(m1 - m2 - m3)/(m1 + m2 + m3)",
        "line.tension": "2*g*m1*m2/(m1 + m2 + m3)",
        "string.tension": "g*m1*(m2 + m3)/(m1 + m2 + m3)",
    },
    "m1 m2 m3 g",
)

FREE_WEDGE = Problem(
    """
gravity: [0, -g, 0]
parameters: {M: 5 kg, m: 1 kg, alpha: 30 deg, g: 10}
bodies:
  wedge: {mass: M, frames: {face: {rotate: [{axis: z, angle: alpha}]}}}
  block: {mass: m}
joints:
  table: {type: prismatic, parent: ground, child: wedge, axis: x, q: x}
  slide: {type: prismatic, parent: wedge.face, child: block, axis: -x, q: s}
""",
    {
        "accelerations.x": "g*m*cos(alpha)*sin(alpha)/(M + m*sin(alpha)^2)",
        "accelerations.s": "g*sin(alpha)*(M + m)/(M + m*sin(alpha)^2)",
        "slide.fy": "M*g*m*cos(alpha)/(M + m*sin(alpha)^2)",
    },
    "M m alpha g",
)

LIFT = Problem(
    """
gravity: [0, -g, 0]
parameters: {M: 500 kg, m: 70 kg, F: 8000 N, g: 10}
bodies: {cabin: {mass: M}, passenger: {mass: m}}
joints:
  shaft: {type: prismatic, parent: ground, child: cabin, axis: y, q: y}
  scale: {type: fixed, parent: cabin, child: passenger}
forces: {cable: {type: force, on: cabin, value: [0, F, 0]}}
""",
    {"accelerations.y": "F/(M + m) - g", "scale.fy": "F*m/(M + m)"},
    "M m F g",
)

CONICAL_PENDULUM = Problem(
    """
gravity: [0, -g, 0]
parameters:
  m: 2 kg
  l: {value: 1 m, positive: true}
  alpha: 60 deg
  g: {value: 10, positive: true}
  omega: sqrt(g/(l*cos(alpha)))
bodies: {arm: {}, bob: {mass: m, com: [0, -l, 0]}}
joints:
  spin: {type: revolute, parent: ground, child: arm, axis: y, q: psi, initial: {u: omega}}
  hinge: {type: revolute, parent: arm, child: bob, axis: z, q: theta, initial: {q: alpha}}
ask: {pull: "sqrt(reaction(hinge, fx)^2 + reaction(hinge, fy)^2 + reaction(hinge, fz)^2)"}
""",
    {
        "accelerations.theta": "0",
        "accelerations.psi": "0",
        "hinge.fy": "g*m",
        "hinge.fx": "-g*m*tan(alpha)",
        "answers.pull": "g*m/cos(alpha)",
    },
    "m l alpha g",
)

RELEASED_ROD = Problem(
    """
gravity: [0, -g, 0]
parameters: {m: 2 kg, l: {value: 1 m, positive: true}, g: 10}
bodies: {rod: {shape: {rod: l, mass: m}, points: {end: [l, 0, 0]}}}
joints: {hinge: {type: revolute, parent: ground, child: rod, axis: z, q: phi}}
ask: {tip: "acceleration(rod.end, y)"}
""",
    {"accelerations.phi": "-3*g/(2*l)", "hinge.fy": "g*m/4", "answers.tip": "-3*g/2"},
    "m l g",
)

LADDER = Problem(
    """
gravity: [0, -g, 0]
parameters: {m: 10 kg, l: {value: 4 m, positive: true}, beta: 60 deg, g: 10}
bodies: {ladder: {shape: {rod: l, mass: m}, com: [0, 0, 0]}}
joints:
  centre: {type: planar, parent: ground, child: ladder, q: [x, y, phi],
           initial: {q: [-l/2*cos(beta), l/2*sin(beta), beta]}}
constraints:
  floor: {type: expression, zero: y - l/2*sin(phi)}
  wall: {type: expression, zero: -x - l/2*cos(phi)}
""",
    {
        "accelerations.phi": "-3*g*cos(beta)/(2*l)",
        "wall.multiplier": "3*g*m*cos(beta)*sin(beta)/4",
        "floor.multiplier": "g*m*(3*sin(beta)^2 + 1)/4",
    },
    "m l beta g",
)

ROLLING = Problem(
    """
gravity: [0, -g, 0]
parameters: {m: 1 kg, r: {value: 0.1 m, positive: true}, alpha: 30 deg, g: 10}
bodies:
  ground: {frames: {plane: {rotate: [{axis: z, angle: -alpha}]}}}
  cylinder: {shape: {cylinder: [r, 1], mass: m}}
joints:
  free: {type: planar, parent: ground.plane, child: cylinder, q: [x, y, phi], initial: {q: [0, r, 0]}}
constraints:
  contact: {type: expression, zero: y - r}
  roll: {type: expression, zero: x + r*phi}
""",
    {
        "accelerations.x": "2*g*sin(alpha)/3",
        "contact.multiplier": "g*m*cos(alpha)",
        "roll.multiplier": "-g*m*sin(alpha)/3",
    },
    "m r alpha g",
)

THREE_HANGING = Problem(
    """
gravity: [0, -g, 0]
parameters:
  m1: 3 kg
  m2: 4 kg
  m3: 3 kg
  g: 10
  b: {value: 4, positive: true}
  h: {value: 3, positive: true}
bodies: {ground: {points: {left: [-b, 0, 0], right: [b, 0, 0]}}, one: {mass: m1}, middle: {mass: m2}, three: {mass: m3}}
pulleys: {P1: {at: ground.left}, P2: {at: ground.right}}
joints:
  j1: {type: prismatic, parent: ground.left, child: one, axis: -y, q: y1, initial: {q: 1}}
  j2: {type: prismatic, parent: ground, child: middle, axis: -y, q: y2, initial: {q: h}}
  j3: {type: prismatic, parent: ground.right, child: three, axis: -y, q: y3, initial: {q: 1}}
constraints: {s1: {type: rope, path: [one, P1, middle]}, s2: {type: rope, path: [three, P2, middle]}}
""",
    {"accelerations.y1": "g*h*(h*(m1 + m3) - m2*sqrt(b^2 + h^2))/(h^2*(m1 + m2 + m3) + m2*b^2)"},
    "m1 m2 m3 g b h",
)

BEAD = Problem(
    """
parameters:
  m: 1 kg
  k: 50
  l: {value: 1 m, positive: true}
  h: {value: 3 m, positive: true}
  x0: {value: 4 m, positive: true}
bodies: {ground: {points: {anchor: [0, h, 0]}}, bead: {mass: m}}
joints: {wire: {type: prismatic, parent: ground, child: bead, axis: x, q: x, initial: {q: x0}}}
forces: {spring: {type: spring_damper, between: [ground.anchor, bead], stiffness: k, length: l}}
""",
    {
        "accelerations.x": "k*x0*(l*sqrt(h^2 + x0^2) - h^2 - x0^2)/(m*(h^2 + x0^2))",
        "wire.fy": "h*k*l/sqrt(h^2 + x0^2) - h*k",
    },
    "m k l h x0",
)

THROWN = Problem(
    """
gravity: [0, -g, 0]
parameters: {g: {value: 10, positive: true}, v: {value: 20, positive: true}, alpha: 30 deg, T: 1.5 s, H: 3.2 m}
bodies: {ball: {mass: 1}, slide: {}}
joints:
  a: {type: prismatic, parent: ground, child: slide, axis: x, q: x, initial: {u: v*cos(alpha)}}
  b: {type: prismatic, parent: slide, child: ball, axis: y, q: y, initial: {u: v*sin(alpha)}}
ask:
  flight: {y: 0}
  at_height: {y: H}
  speed: {of: ball, at: {y: H}}
  there: {x: 10}
""",
    {
        "answers.flight": "2*v*sin(alpha)/g",
        "answers.at_height": "(v*sin(alpha) - sqrt(v^2*sin(alpha)^2 - 2*H*g))/g",
        "answers.speed": "sqrt(v^2 - 2*H*g)",
        "answers.there": "10/(v*cos(alpha))",
    },
    "g v alpha H",
)

PROBLEMS = {
    name: value for name, value in list(globals().items()) if isinstance(value, Problem)
}
