"""Numbers of what is wrong in a model."""

from __future__ import annotations

from typing import Final

from multibody_sym.cli.explained.page import BALL, Explained, other, pendulum, slider

MODELS: Final[dict[str, Explained]] = {
    # --- models
    "M100": Explained(
        "Parts of the model do not fit together",
        "What is declared at the place that is named contradicts something else, for a reason without a number of its "
        "own.",
        "The message says what and with what; change one of the two.",
        slider() + "stop: {never: 1 < 2}\n",
    ),
    "M101": Explained(
        "A key is not known",
        "A key is misspelt, or stands at the wrong level.",
        "Take the key that is suggested; the reference lists all keys of each element, and the JSON Schema lets an "
        "editor complete them.",
        pendulum(("mass: m", "mas: m")),
    ),
    "M102": Explained(
        "Something is missing",
        "A key that has no default is not given, or is empty.",
        "Write it; the reference tells what it takes.",
        pendulum((", child: bob", "")),
    ),
    "M103": Explained(
        "The content is of another kind",
        "A number is wanted and a list stands there, two components where three are wanted, or the like.",
        "Write what the message expects.",
        pendulum(("[0, -l, 0]", "[0, -l]")),
    ),
    "M104": Explained(
        "The word is not one of those that fit",
        "A type or choice is misspelt or does not exist.",
        "Take one of the words that are listed.",
        pendulum(("type: revolute", "type: hinged")),
    ),
    "M105": Explained(
        "The unit does not fit",
        "A quantity with a unit stands where another dimension is wanted.",
        "Correct the unit; a number without one fits everywhere, in SI.",
        pendulum(("mass: m", "mass: 3 m")),
    ),
    "M106": Explained(
        "The name belongs to nothing",
        "A body, point, frame, joint, parameter or coordinate is named that the model does not declare.",
        "Correct the name, or declare what it names.",
        pendulum(("child: bob", "child: bobb")),
    ),
    "M107": Explained(
        "An expression names what is not declared",
        "A name in an expression is no parameter, coordinate, speed or input.",
        "Declare it under parameters, with a sample value, or correct it.",
        pendulum(("-l, 0]", "-length, 0]")),
    ),
    "M108": Explained(
        "The name cannot be taken",
        "Two things of the model would have one name, or the name cannot stand in expressions.",
        "Choose another name: letters, digits and _, a letter first.",
        pendulum(("q: theta", "q: m")),
    ),
    "M109": Explained(
        "The number is out of range",
        "A coefficient, length or count is negative, zero or too large for what it is.",
        "Correct the number or its sign.",
        slider() + "forces: {rub: {type: friction, joint: guide, static: -0.2}}\n",
    ),
    "M110": Explained(
        "Keys do not go together",
        "Two keys say the same thing, one needs another, or lists have different lengths.",
        "Keep one of them, or add what belongs to it.",
        slider() + "forces: {s: {type: spring, stiffness: k, joint: guide, between: [ground, block]}}\n",
    ),
    "M111": Explained(
        "Joints do not lead from ground to every body",
        "A body hangs on nothing, on itself, or on a circle of joints that never reaches ground.",
        "Add a joint with this body as child; a body that moves freely has a joint of the type free.",
        pendulum(("bodies: {", "bodies: {lost: {mass: 1}, ")),
    ),
    "M112": Explained(
        "The quantity cannot be asked so",
        "fx(..), tension(..) and the like are asked of something that has none, or where they are not known.",
        "Ask the components that are listed, under outputs, stop or ask.",
        pendulum() + 'outputs: {pull: "normal(hinge)"}\n',
    ),
    "M113": Explained(
        "An expression names what may not stand there",
        "Lengths do not depend on coordinates, inputs not on speeds, constraints of positions not on speeds.",
        "Name what the message allows; a velocity constraint has the type velocity.",
        slider() + "constraints: {c: {type: velocity, zero: x - 1}}\n",
    ),
    "M114": Explained(
        "These surfaces cannot touch, or start inside each other",
        "Two surfaces are named of which contacts are not known, or whose start positions overlap; or a plane does not "
        "lead through its ends.",
        "Name points, round surfaces or planes as the message says; move the body out along the normal.",
        other(BALL, ("[0, 0.1, 0]", "[0, 0.05, 0]")) + "contacts: {c: {between: [ball.rim, ground.floor]}}\n",
    ),
    "M115": Explained(
        "The path of a rope is not possible",
        "A rope ends in the air, runs over one pulley twice, or does not tell on which side it leaves a drum.",
        "Name points of bodies at both ends; say wrap or wind where the message asks for it.",
        slider()
        + "pulleys: {P: {at: ground, radius: 0.1}}\nconstraints: {r: {type: rope, path: [block, P, P, ground]}}\n",
    ),
    "M116": Explained(
        "The wheels of a gear do not mesh",
        "Radii, ratio and the distance of the axes contradict each other, or a wheel is on no revolute joint.",
        "Correct the radii or the ratio (negative where wheels touch outside), or leave the radii out.",
        """\
multibody_sym: 1
name: gear
bodies: {a: {mass: 1, inertia: {Izz: 1}}, b: {mass: 1, inertia: {Izz: 1}}, ground: {points: {B: [0.3, 0, 0]}}}
joints:
  A: {type: revolute, parent: ground, child: a}
  B: {type: revolute, parent: ground.B, child: b}
constraints: {mesh: {type: gear, joints: [A, B], ratio: -2, radii: [0.1, 0.1]}}
""",
    ),
    "M117": Explained(
        "The settings of the run contradict each other",
        "A method without error estimate has no step, one that chooses its steps got one, or there are too many steps.",
        "Give a step, or tolerances, as the method needs it.",
        pendulum() + "simulation: {method: rk4}\n",
        ("simulate",),
    ),
    "M118": Explained(
        "A mass or inertia is impossible",
        "No body has such numbers: one principal moment exceeds the sum of the others, or a mass is negative.",
        "Correct mass, centre of mass or inertia; inertia is about the centre of mass.",
        pendulum(("-l, 0]", "-l, 0], inertia: {Ixx: 1, Iyy: 1, Izz: 3}")),
    ),
    "M119": Explained(
        "Something has no value at the start",
        "With the parameters and start values a number is not finite or a direction is not determined.",
        "Correct the expression, or start from another state.",
        slider(("q: x}", "q: x, initial: {q: 1/(m - 1)}}")).replace("m: 1 kg", "m: 1"),
    ),
    "M120": Explained(
        "This method does not take such a system",
        "Each method of derivation has systems that it cannot write down: Lagrange's second kind takes no constraints.",
        "Choose one of the methods that the message names; without --method the program does.",
        slider() + "constraints: {c: {type: expression, zero: x - 1}}\n",
        ("derive", "--method", "lagrange"),
    ),
    "M121": Explained(
        "The impact is not possible as declared",
        "What strikes is apart, does not move together, or its parts do not go together.",
        "Start where it closes, or correct normal, names and law.",
        other(BALL, ("[0, 0.1, 0]", "[0, 0.5, 0]"))
        + "impact: {contacts: [c]}\ncontacts: {c: {between: [ball.rim, ground.floor], open: true}}\n",
        ("solve",),
    ),
}
