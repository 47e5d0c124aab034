"""Mistakes that beginners make: each is reported with its place in the file, its cause and its cure; none is silent.

« stands before the word, or the key of the part, that the message points at; it is no part of the file.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from multibody_sym.analysis.hints import declared_hints
from multibody_sym.cli.main import main
from multibody_sym.errors import InputError
from multibody_sym.mechanics.model_files import load_with_places
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.urdf import UrdfNotice, load_urdf

PENDULUM = """\
multibody_sym: 1
name: pendulum
gravity: [0, -g, 0]
parameters: {m: 1 kg, l: 0.5 m, g: 9.81 m/s^2}
bodies: {bob: {mass: m, com: [0, -l, 0]}}
joints: {hinge: {type: revolute, parent: ground, child: bob, axis: z, q: phi, initial: {q: 0.5}}}
"""
BLOCK = """\
multibody_sym: 1
name: block
gravity: [0, -g, 0]
parameters: {m: 1 kg, h: 0.2 m, g: 9.81 m/s^2, mu: 0.3}
bodies: {block: {shape: {box: [h, h, h], mass: m}}, ground: {surfaces: {table: {plane: [0, 0, 0], normal: y}}}}
joints: {slide: {type: planar, parent: ground, child: block, q: [x, y, th], initial: {q: [0, h/2, 0]}}}
contacts: {c: {between: [block, ground.table], static: mu}}
"""
LOADS = """\
multibody_sym: 1
name: loads
gravity: [0, -g, 0]
parameters: {m: 1 kg, g: 9.81 m/s^2}
bodies: {ground: {points: {axle: [0, 5 m, 0]}}, left: {mass: m}, right: {mass: 2*m}}
joints:
  line1: {type: prismatic, parent: ground, child: left, axis: y, q: y1, initial: {q: 0}}
  line2: {type: prismatic, parent: ground, child: right, axis: y, q: y2, initial: {q: 0}}
constraints: {string: {type: rope, path: [left, pulley, right]}}
pulleys: {pulley: {at: ground.axle}}
"""
BELT = """\
multibody_sym: 1
name: belt
gravity: [0, 0, 0]
parameters: {m: 1 kg, r: 0.1 m}
bodies: {ground: {points: {right: [1 m, 0, 0]}}, big: {shape: {disc: 3*r, mass: m}}, small: {shape: {disc: r, mass: m}}}
joints: {A: {type: revolute, parent: ground, child: big}, B: {type: revolute, parent: ground.right, child: small}}
pulleys: {P: {body: big, radius: 3*r}, Q: {body: small, radius: r}}
constraints: {belt: {type: rope, path: [P, Q, P], wrap: "+"}}
"""
ROLLER = BLOCK.replace("box: [h, h, h]", "disc: h/2").replace(
    "contacts: {c: {between: [block, ground.table], static: mu}}",
    "constraints: {c: {type: rolling, body: block, on: ground.table, kinetic: mu}}",
)
GUIDED = """\
multibody_sym: 1
name: guided
gravity: [0, -g, 0]
parameters: {m: 1 kg, g: 9.81 m/s^2}
bodies: {block: {mass: m}, ground: {surfaces: {table: {plane: [0, 0, 0], normal: y}}}}
joints: {slide: {type: prismatic, parent: ground, child: block, axis: x}}
contacts: {c: {between: [block, ground.table]}}
"""
WHEEL = """\
multibody_sym: 1
name: wheel
gravity: [0, -g, 0]
parameters: {m: 1 kg, d: 0.2 m, g: 9.81 m/s^2}
bodies: {wheel: {shape: {disc: d/2, mass: m}}}
joints: {axle: {type: revolute, parent: ground, child: wheel}}
"""
GEARS = """\
multibody_sym: 1
name: gears
gravity: [0, 0, 0]
parameters: {J: 1 kg*m^2, M: 3 N*m}
bodies: {a: {inertia: {Izz: J}}, b: {inertia: {Izz: 2*J}}}
joints: {A: {type: revolute, parent: ground, child: a}, B: {type: revolute, parent: ground, child: b}}
constraints: {mesh: {type: gear, joints: [A, B], ratio: -5}}
forces: {drive: {type: torque, joint: A, value: M}}
"""
LOOP = """\
multibody_sym: 1
name: loop
gravity: [0, 0, 0]
parameters: {m: 1 kg, J: 1 kg*m^2}
bodies:
  a: {mass: m, points: {p: [1 m, 0, 0]}, inertia: {Ixx: J, Iyy: J, Izz: J}}
  b: {mass: m, points: {p: [1 m, 0, 0]}, inertia: {Ixx: J, Iyy: J, Izz: J}}
joints:
  A: {type: revolute, parent: ground, child: a}
  B: {type: revolute, parent: a.p, child: b, axis: z}
  C: {type: revolute, parent: ground, child: b.p, cut: true}
"""
BODY = "{mass: m, com: [0, -l, 0]}"
ROWS = [
    # units and numbers
    (PENDULUM, "{q: 0.5}", "{q: «30}", "30 rad, 4.77 turns", "write the unit: 30 deg"),
    (PENDULUM, "0.5}}}", "0.5}, limits: {lower: «-90}}}", "limit of joint hinge is -90, which counts as", "-90 deg"),
    (
        PENDULUM, "{bob:", "{ground: {frames: {s: {rotate: [{axis: z, angle: «30}]}}}, bob:",
        "counts as 30 rad", "30 deg",
    ),
    (PENDULUM, "com: [0, -l, 0]", "com: [0, «-l*sin(30), 0]", "sin(30) takes 30 rad", "sin(30*pi/180)"),
    (PENDULUM, "m: 1 kg", "m: «500", "counts as 500 kg", "if grams are meant: 500 g"),
    (PENDULUM, "l: 0.5 m", "l: «500", "counts as 500 m", "if millimetres are meant: 500 mm"),
    (PENDULUM, "mass: m", "mass: «10 N", "'10 N' does not fit here", "a quantity in kg"),
    (PENDULUM, "9.81 m/s^2", "9.81 m/«s2", "'s2' is not a unit", "did you mean s^2?"),
    (PENDULUM, "g: 9.81 m/s^2", "g: 9.81, L: 3 «Nms", "'Nms' is not a unit", "did you mean Nm*s?"),
    (PENDULUM, "g: 9.81 m/s^2", "g: 9.81, c: .5 «Ns/m", "'Ns' is not a unit", "did you mean N*s?"),
    (PENDULUM, "g: 9.81 m/s^2", "g: 9.81, c: .5 m/«Ns", "'Ns' is not a unit", "did you mean (N*s)?"),
    (PENDULUM, "g: 9.81 m/s^2", "g: 9.81, J: 5 «kgm2", "'kgm2' is not a unit", "did you mean kg*m^2?"),
    (PENDULUM, "m: 1 kg", "m: 1 «kgs", "'kgs' is not a unit", "did you mean kg?"),
    (PENDULUM, "m: 1 kg", "m: 1 «Kg", "'Kg' is not a unit", "did you mean kg?"),
    (PENDULUM, "{q: 0.5}", "{q: 30«°}", "has no place in an expression", "write deg"),
    (PENDULUM, "9.81 m/s^2", "9.81 m/s«²", "has no place in an expression", "write ^2"),
    (PENDULUM, "{q: 0.5}", "{q: 0.5, u: «2 m/s}", "2 m/s", "rad/s"),
    (PENDULUM, "", "forces: {f: {type: torque, joint: hinge, value: «3 N}}", "3 N", "N*m"),
    (PENDULUM, "", "simulation: {t_end: 10 «sec}", "'sec' is not a unit", "did you mean s?"),
    (PENDULUM, "g: 9.81 m/s^2", "g: 9,«81", "a comma begins the next entry", "decimal point, 9.81"),
    (PENDULUM, "com: [0, -l, 0]", "«com: [0, -0,5, 0]", "a list of 4", "decimal point, 0.5"),
    (PENDULUM, "l: 0.5 m", "l: 1.5«.2 m", "1.5.2 has two decimal points", "two decimal points"),
    (PENDULUM, "m: 1 kg", "m: 1 «000 kg", "before '000'", "written without blanks, 1000"),
    (BLOCK, "mu: 0.3", "mu: 30«%", "'%' has no place", "write a percentage as a decimal"),
    (BLOCK, "mu: 0.3", "mu: «30", "30 is above coefficients of friction", "30 % is 0.3"),
    (BLOCK, "static: mu", "static: «20 deg", "20 deg is an angle", "its tangent, tan(pi/9)"),
    (BLOCK, "0.3}", "20 deg, nu: mu}", "is an angle; a coefficient of friction is its tangent", "tan(mu)"),
    (BLOCK, "static: mu", "static: mu, restitution: «1.5", "1.5 is no coefficient of restitution", "between 0"),
    (BLOCK, "static: mu", "static: mu, restitution: «-0.5", "-0.5 is no coefficient of restitution", "between 0"),
    (BLOCK, "static: mu", "static: «0.3, kinetic: 0.5", "static 0.3 is below kinetic 0.5", "swap them"),
    # expressions
    (PENDULUM, "", "outputs: {x: l*«Sin(phi)}", "no function 'Sin'", "did you mean sin?"),
    (PENDULUM, "", "outputs: {x: «arcsin(0.5)}", "no function 'arcsin'", "did you mean asin(x)?"),
    (PENDULUM, "{q: 0.5}", "{q: «PI/2}", "'PI' is not declared", "did you mean pi?"),
    (PENDULUM, "", "outputs: {x: «e^(-t/2)}", "'e' is not declared", "did you mean exp(1)?"),
    (PENDULUM, "", "outputs: {x: m «g}", "an operator is missing", "m*g"),
    (
        PENDULUM, "com: [0, -l, 0]", "com: [0, 3 m «+ l, 0]",
        "has no place in a unit", "give the number with the unit a name",
    ),
    (PENDULUM, "", 'outputs: {x: "l*(m + 1)«)"}', "this ) closes nothing", "leave it out"),
    (PENDULUM, "", "outputs: {x: «reaction(hinge, fy)}", "contains a comma", 'is quoted: "reaction(hinge'),
    (PENDULUM, "", "outputs: {w: 2*«phi_dot}", "'phi_dot' is not declared", "did you mean u_phi, the speed?"),
    (PENDULUM, "com: [0, -l, 0]", "com: [0, -«L, 0]", "'L' is not declared", "did you mean l?"),
    # YAML
    (PENDULUM, "bodies: {bob", "bodies:\n«\tbob: {mass: m}\n#", "a tab has no place", "indent with blanks"),
    (PENDULUM, "{m: 1 kg,", "{«m = 1 kg,", "a colon and a blank stand between", "m: 1 kg"),
    (PENDULUM, "gravity: [", "«gravity:[", "a colon and a blank stand between", "gravity: [0, -g, 0]"),
    (PENDULUM, "com: [0, -l, 0]", "com: [0, -l, 0«", "is missing before '}'", "a ',' or ']'"),
    (PENDULUM, "{m: 1 kg,", "{m: 1 kg, «m: 2 kg,", "stands here a second time", "first in line 4"),
    (LOADS, "right]", "right], slack: «on", "got 'on'", "expected true or false"),
    # keys and names
    (PENDULUM, "{bob: {mass", "{bob: {«Mass", "unknown key 'Mass'", "did you mean mass?"),
    (PENDULUM, "initial:", "«intial:", "unknown key 'intial'", "did you mean initial?"),
    (PENDULUM, "{q: 0.5}", "{«phi: 30 deg}", "unknown key 'phi'", "{q: 30 deg"),
    (PENDULUM, f"bodies: {{bob: {BODY}}}", "«bodies: [{name: bob}]", "got a list", "without dashes: {bob: {..}}"),
    (PENDULUM, BODY, "{shape: {«disk: l, mass: m}}", "unknown key 'disk'", "did you mean disc?"),
    (PENDULUM, BODY, "{«shape: {cylinder: l, mass: m}}", "a cylinder has 2 sizes, got 1", "cylinder: [radius, length]"),
    (PENDULUM, "com: [0, -l, 0]", "com: [0, -l, 0], inertia: «0.1", "expected a map", "Izz"),
    (PENDULUM, "child: bob", "child: «Bob", "no body is called 'Bob'", "did you mean bob?"),
    (
        PENDULUM, "parent: ground", "parent: «ground.top",
        "no point or frame 'top'", "ground: {points: {top: [x, y, z]}}",
    ),
    (PENDULUM, "parent: ground", "«parent: [0, 1, 0]", "expected a name, got a list", "points: {NAME: [x, y, z]}"),
    (PENDULUM, "q: phi", "q: «φ", "'φ' cannot stand in expressions", "use letters, digits and _"),
    (PENDULUM, "{m: 1 kg,", "{«t: 1 s, m: 1 kg,", "'t' cannot be a parameter: it is the time", "choose another name"),
    (LOADS, "q: y2", "q: «y1", "'y1' cannot be a coordinate: it is one already", "choose another name"),
    (PENDULUM, "", "«output: {x: l}", "unknown key 'output'", "did you mean outputs?"),
    (PENDULUM, "", "stop: «phi > 1", "expected a map of names", "under a name: {NAME: phi > 1}"),
    (PENDULUM, "", "ask: {v: {of: bob, at: «t == 0}}", "'t == 0' is an equation", "the start needs no moment"),
    (BLOCK, "", "ask: {v: {when: «c rests}}", "'rests' is no word for a state", "sticks, slides, opens, closes"),
    (BLOCK, "", "ask: {F: {find: mu, so: mu == 1, «ask: N}}", "unknown key 'ask'", "{find: mu, so: N == 1}"),
    (PENDULUM, "initial: {q: 0.5}", "initial: «30 deg", "expected a map", "such as {q: 30 deg}"),
    (PENDULUM, "parent: ground, child: bob, ", "", "parent and child are missing", "the body, point or frame that"),
    (PENDULUM, BODY, "{shape: {«spher: l, mass: m}}", "unknown key 'spher'", "did you mean sphere?"),
    (PENDULUM, "{type: revolute", "{«typ: revolute", "unknown key 'typ'", "did you mean type?"),
    (PENDULUM, "m: 1 kg", "m: {«val: 1 kg}", "unknown key 'val'", "did you mean value?"),
    (PENDULUM, "", "outputs: {w: «phidot}", "'phidot' is not declared", "did you mean u_phi, the speed?"),
    (PENDULUM, "", "outputs: {w: «dphi}", "'dphi' is not declared", "did you mean u_phi, the speed?"),
    (PENDULUM, "", "outputs: {w: «psi}", "'psi' is not declared", "did you mean phi?"),
    (PENDULUM, "", "forces: {f: {type: friction, joint: hinge, «mu: 1}}", "unknown key 'mu'", "did you mean static?"),
    (PENDULUM, "", "stop: {end: «c1 resting}", "'resting' is no word for a state", "sticks, slides, opens, closes"),
    # mechanics
    (PENDULUM, "gravity: [0, -g, 0]\n", "", "no gravity is declared", "write gravity: [0, -9.81, 0]"),
    (PENDULUM, "gravity: [0, -g, 0]", "«gravity: [0, g, 0]", "gravity points along +y", "[0, -g, 0]"),
    (
        PENDULUM, "g: 9.81 m/s^2", "g: «-9.81 m/s^2",
        "g is negative, so that gravity points along +y", "write it positive",
    ),
    (PENDULUM, "gravity: [0, -g, 0]", "«gravity: [0, 0, -g]", "gravity points along z", "[0, -g, 0]"),
    (PENDULUM, "gravity: [0, -g, 0]", "gravity: «-g", "expected a list of three", "along y [0, -g, 0]"),
    (PENDULUM, "parent: ground, ", "", "parent is missing", "the body, point or frame that carries the joint"),
    (PENDULUM, "parent: ground, child: bob", "parent: bob, child: bob", "itself", ""),
    (PENDULUM, "com: [0, -l, 0]", "«com: [0, -l]", "a list of 2", "the third is 0"),
    (PENDULUM, "0.5}}}", "0.5}}, «j: {type: revolute, parent: ground, child: bob}}", "both join bob", "cut: true"),
    (PENDULUM, "0.5}}}", "0.5}, «limits: {lower: 1, upper: 0}}}", "lower limit 1 is above the upper one 0", "above"),
    (PENDULUM, "{bob: {mass: m, ", "{«bob: {", "body bob has no mass", "give it one (mass: 1 kg)"),
    (PENDULUM, BODY + "}", BODY + ", «eye: {}}", "nothing joins 'eye' to the rest", "add a joint with child: eye"),
    (PENDULUM, "{bob:", "{ground: {mass: «1 kg}, bob:", "its mass changes nothing", "a body of another name"),
    (PENDULUM, "com: [0, -l, 0]", "com: [0, -l/2, 0], inertia: {Izz: «m*l^2/3}", "that about an end", "m*l^2/12"),
    (
        PENDULUM, BODY, "{shape: {rod: l, mass: m}, points: {«a: [-l/2, 0, 0]}}",
        "lies half a length before", "[l/2, 0, 0]",
    ),
    (PENDULUM, "", "forces: {f: {type: force, on: bob, value: «5 N}}", "expected a list of three", "[5 N, 0, 0]"),
    (PENDULUM, "", "forces: {f: {type: friction, «on: bob}}", "unknown key 'on'", "joint: NAME; where bodies touch"),
    (
        PENDULUM, "", "forces: {«f: {type: friction, joint: hinge, static: 0.3}}",
        "a hinge rubs on a journal", "give its radius",
    ),
    (PENDULUM, "", "forces: {s: {type: spring, joint: hinge, «k: 10}}", "unknown key 'k'", "stiffness"),
    (
        PENDULUM, "", "forces: {s: {type: spring, «between: [bob, bob], stiffness: 1 N/m}}",
        "points of bob", "moves nothing",
    ),
    (PENDULUM, "", "constraints: {«r: {type: distance, between: [bob, ground]}}", "value is missing", "how far apart"),
    (LOADS, "right]", "«pully, right]", "no body or pulley is called 'pully'", "did you mean pulley?"),
    (LOADS, "right]", "«Q, right]", "no body or pulley is called 'Q'", "known: pulley, "),
    (LOADS, "[left, pulley, right]", "[left, «pulley]", "pulley", "end"),
    (LOADS, "ground.axle}", "ground.axle, «diameter: 1 m}", "unknown key 'diameter'", "radius"),
    (WHEEL, "disc: d/2", "disc: «d", "d stands for a radius here", "if it is the diameter: d/2"),
    (
        LOADS, "ground.axle}", "ground.axle, radius: 0.1 m}",
        "passes the axis of pulley at 0 m", "shift the body's joint",
    ),
    (GEARS, "joint: A", "joint: «B", "the slow side of gear mesh", "if a motor drives that one: joint: A"),
    (
        PENDULUM, "", "constraints: {r: {type: «rod, between: [bob, ground], value: l}}",
        "'rod' is no known type", "did you mean distance?",
    ),
    (
        PENDULUM, "", "forces: {s: {type: spring, joint: hinge, stiffness: «-3 N*m}}",
        "stiffness -3 is negative: such a spring pushes away", "leave the minus out",
    ),
    (PENDULUM, "", "outputs: {x: «phi(t)}", "no function 'phi'", "is written without it: phi"),
    (PENDULUM, "type: revolute", "type: «rotation", "'rotation' is no known type", "did you mean revolute?"),
    (LOADS, "line1: {type: prismatic", "line1: {type: «translational", "is no known type", "did you mean prismatic?"),
    (PENDULUM, "", "forces: {f: {type: «gravity, on: bob}}", "'gravity' is no known type", "gravity: [0, -g, 0]"),
    (PENDULUM, "", "forces: {f: {type: force, on: bob, «F: 3 N}}", "unknown key 'F'", "did you mean value?"),
    (PENDULUM, "", "forces: {f: {type: force, on: bob, «magnitude: 3 N}}", "'magnitude'", "three components"),
    (PENDULUM, "", "forces: {f: {type: drag, on: bob, «c: 0.1}}", "unknown key 'c'", "linear (c*v)"),
    (PENDULUM, "", "forces: {«f: {type: drag, on: bob}}", "f has no coefficient", "give linear, quadratic or both"),
    (BLOCK, "static: mu", "«mu: mu", "unknown key 'mu'", "did you mean static?"),
    (BLOCK, "static: mu", "static: mu, «e: 0.5", "unknown key 'e'", "did you mean restitution?"),
    (PENDULUM, "{m: 1 kg,", "{m: {value: 1, «unit: kg},", "unknown key 'unit'", "{value: 1 kg}"),
    (PENDULUM, "0.5}}}", "0.5}, limits: {«min: -1}}}", "unknown key 'min'", "did you mean lower?"),
    (PENDULUM, "com: [0, -l, 0]", "com: [0, -l, 0], inertia: {«Iz: 1}", "unknown key 'Iz'", "did you mean Izz?"),
    (PENDULUM, "com: [0, -l, 0]", "com: [0, -l, 0], inertia: {«Iyx: 0.1}", "unknown key 'Iyx'", "did you mean Ixy?"),
    (PENDULUM, "", "outputs: {E: «kinetic_energy}", "'kinetic_energy' is not declared", "did you mean kinetic_energy("),
    (PENDULUM, "", "stop: {s: «phi == 0}", "is an equation", "write a comparison that becomes true there"),
    (PENDULUM, "", "inputs: {F: {table: [[0, 0], [1 s, 5 N]], interpolation: «spline}}", "is no choice here", "cubic?"),
    (PENDULUM, "", "stop: {s: phi «=> 3}", "'=>' is no comparison", "write >="),
    (PENDULUM, "", "ask: {v: {of: bob, at: phi «=< 3}}", "'=<' is no comparison", "write <="),
    (BLOCK, "", "stop: {s: «c sticks and x > 1}", "states are not joined", "name the state alone, such as c sticks"),
    (BLOCK, "", "ask: {s: «(c.corner1 slides) or x > 1}", "states are not joined", "alone, such as c.corner1 slides"),
    (BLOCK, "", "ask: {s: {max: y, when: «c slide+ or x > 1}}", "states are not joined", "alone, such as c slide+"),
    (PENDULUM, "com: [0, -l, 0]", "«com: [0 -l 0]", "a list of 1", "commas stand between"),
    (GEARS, "ratio: -5", "ratio: «0", "with a ratio of 0 the first joint could not turn", "as fast as the second"),
    (LOOP, "axis: z", "«axis: [0, 0.17, 1]", "differ by 9.65 deg", "parallel axes"),
    (PENDULUM, "{q: 0.5}", "{q: 0.5, u: 3 rad/«sec}", "'sec' is not a unit", "did you mean s?"),
    (PENDULUM, "9.81 m/s^2", "9.81 N", "is a quantity in N", "one in m/s^2 is wanted"),
    (PENDULUM, "axis: z", "axis: «Z", "'Z' is no direction", "write x, y, z"),
    (PENDULUM, "axis: z", "«axis: [0, 0, 0]", "a direction cannot be zero", ""),
    (PENDULUM, "mass: m", "«mass:", "mass is empty", "write what it is, or leave it out"),
    (PENDULUM, "", "outputs: {x: sqrt «l}", "the argument of sqrt", "stands in parentheses"),
    (PENDULUM, "parent: ground, child: bob", "parent: bob, child: «ground", "cannot be a child", "swap parent"),
    (PENDULUM, "parent: ground", "parent: «ground.top", "no point or frame 'top'", "points: {top: [x, y, z]}"),
    (PENDULUM, "", "forces: {s: {type: spring, joint: hinge, stiffness: «3 N/m}}", "does not fit", "N*m"),
    (BLOCK, "ground.table", "«ground.tabel", "is no surface", "did you mean ground.table?"),
    (BLOCK, ", normal: y", "", "has the normal z", "Give it the normal"),
    (LOADS, "path: [left, pulley, right]", "length: 3 m", "path is missing", "such as path: [block, P1, load]"),
    (LOADS, "path:", "«between:", "unknown key 'between'", "known: path, length"),
    (PENDULUM, "", "simulation: {t_end: 1 «minute}", "'minute' is not a unit", "did you mean min?"),
]
OF_STARTS = [
    ("check", PENDULUM, "m: 1 kg", "m: -1 kg", "no mass is negative", "a hole is welded"),
    ("check", LOOP, "Izz: J", "Izz: 5*J", "of no body is one more than the sum", "correct them"),
    ("check", PENDULUM, "l: 0.5 m", "l: «2*b, b: l/2", "depend on each other in a circle", "l -> b -> l"),
    ("check", PENDULUM, ", com: [0, -l, 0]", "", "no inertia resists the speed u_phi", "inertia: {Izz: m*l^2/12}"),
    (
        "check", PENDULUM, "", "constraints: {«r: {type: distance, between: [bob.com, ground], value: 3 m}}",
        "its ends are 2.5 m too near", "correct it, or leave it out",
    ),
    ("check", LOADS, "right]", "right], length: «8 m", "start values were changed (y2 by 2", "without a length it is"),
    ("check", LOADS, "right]", "right], length: 8 m, slack: true", "2 m longer than the rope is", "give it its length"),
    (
        "check", BLOCK, "normal: y", "normal: -y",
        "starts 0.2 m inside ground.table", "its normal points out of its body",
    ),
    ("check", GUIDED, "c: {", "«c: {", "determine the gap of contact c", "leave the contact out"),
    (
        "solve", BLOCK, ", static: mu}}", "}}\nask: {s: {when: «c sticks}}\n#",
        "no such state without friction", "static",
    ),
    (
        "solve", ROLLER, "", "ask: {s: {when: «c sticks}}",
        "no such state: a wheel that rolls has the words rolls, slips", "c rolls",
    ),
    ("simulate", PENDULUM, "", "simulation: {method: «rk45}", "there is no method 'rk45'", "did you mean RK45?"),
    ("check", PENDULUM, "", "simulation: {method: «rk45}", "there is no method 'rk45'", "did you mean RK45?"),
    ("solve", PENDULUM, "", "simulation: {t_end: «-1}", "simulation.t_end", "expected a positive number, got -1"),
    ("draw", PENDULUM, "", "simulation: {t_end: «l - 2*l}", "simulation.t_end", "expected a positive number, got -0.5"),
    ("derive", PENDULUM, "", "simulation: {samples: «0}", "expected a whole number, at least 2", "got 0"),
    ("equilibrium", PENDULUM, "", "simulation: {rtol: «1e-30}", "finer than the numbers are", "ask for 1e-15 or more"),
]


def told(text: str) -> str:
    """Return mistakes and hints of a model file as commands print them."""
    try:
        system, places = load_with_places("m.yaml", text.encode())
    except InputError as error:
        return str(error)
    try:
        mechanism(system)
    except InputError as error:
        return str(places.with_others(error, mechanism))
    return "\n".join(places.told(hint, hint.path) for hint in declared_hints(system))


def mistaken(base: str, was: str, written: str) -> tuple[str, str]:
    """Return a model with a mistake, and the place of the mark as messages print it."""
    assert was in base
    text = base.replace(was, written, 1) if was else f"{base}{written}\n"
    before, mark, _ = text.partition("«")
    line = before.split("\n")[-1]
    return text.replace("«", ""), f"m.yaml:{before.count(chr(10)) + 1}:{len(line) + 1}: " if mark else "m.yaml:"


@pytest.mark.parametrize(("base", "was", "written", "cause", "cure"), ROWS)
def test_a_message_says_where_why_and_what_to_write(base: str, was: str, written: str, cause: str, cure: str) -> None:
    text, place = mistaken(base, was, written)
    message = told(text)
    shown = [line for line in message.splitlines() if cause in line and cure in line]
    assert shown, message
    assert place in shown[0]
    assert "gravity" in cause or "\n  " in message  # the line of the file and a caret, where there is a line


@pytest.mark.parametrize(("command", "base", "was", "written", "cause", "cure"), OF_STARTS)
def test_so_do_messages_about_starts_and_answers(
    command: str, base: str, was: str, written: str, cause: str, cure: str,
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    text, place = mistaken(base, was, written)
    Path("m.yaml").write_text(text)
    main([command, "m.yaml"])
    printed = "".join(capsys.readouterr())
    assert [word for word in (place, cause, cure) if word not in printed] == [], printed


@pytest.mark.parametrize("base", [PENDULUM, BLOCK, LOADS, GEARS, LOOP, WHEEL, BELT, ROLLER])
def test_models_without_mistakes_have_no_message(base: str) -> None:
    assert told(base) == ""


def test_a_robot_whose_shapes_are_meshes_says_that_these_are_not_read(tmp_path: Path) -> None:
    mesh = '<visual><geometry><mesh filename="base.stl"/></geometry></visual>'
    (tmp_path / "r.urdf").write_text(f'<robot name="r"><link name="base">{mesh}</link></robot>')
    with pytest.warns(UrdfNotice, match=r"meshes are not read \(declare surfaces for contacts\): base"):
        load_urdf(tmp_path / "r.urdf")
