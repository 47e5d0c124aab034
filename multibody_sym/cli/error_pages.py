"""The page of an error, and the small models that pages change."""

from __future__ import annotations

from typing import Final, NamedTuple

PENDULUM: Final = """\
multibody_sym: 1
name: pendulum
gravity: [0, -9.81, 0]
parameters: {m: 1 kg, l: 0.5 m}
bodies: {bob: {mass: m, com: [0, -l, 0]}}
joints: {hinge: {type: revolute, parent: ground, child: bob, axis: z, q: theta}}
"""
SLIDER: Final = """\
multibody_sym: 1
name: block
gravity: [0, -9.81, 0]
parameters: {m: 1 kg, k: 10 N/m}
bodies: {block: {mass: m}}
joints: {guide: {type: prismatic, parent: ground, child: block, axis: x, q: x}}
"""
BALL: Final = """\
multibody_sym: 1
name: ball
gravity: [0, -9.81, 0]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  ball: {mass: 1, inertia: {Izz: 0.1}, surfaces: {rim: {disc: 0.1}}}
joints: {move: {type: planar, parent: ground, child: ball, initial: {q: [0, 0.1, 0]}}}
"""


class Explained(NamedTuple):
    """What a number means. `words` are the command and its options; `file` the model that makes it fail so.

    Where there is no file, `python` is a call that fails so, or nothing does so on purpose.
    """

    title: str
    cause: str
    cure: str
    file: str = ""
    words: tuple[str, ...] = ("check",)
    python: str = ""


def other(text: str, *changes: tuple[str, str]) -> str:
    """Return a model with pieces of its text replaced."""
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text


def pendulum(*changes: tuple[str, str]) -> str:
    """Return the pendulum with pieces replaced."""
    return other(PENDULUM, *changes)


def slider(*changes: tuple[str, str]) -> str:
    """Return the block on a guide with pieces replaced."""
    return other(SLIDER, *changes)


# ----------------------------------------------------------------------------------------------------------------------
# Numbers of what is wrong before a model is known: arguments, expressions, files.


INPUTS: Final[dict[str, Explained]] = {
    # --- calls from Python
    "A100": Explained(
        "An argument is of the wrong kind",
        "A function got a value of a kind that it does not take: text for a number, a number for a name.",
        "Hand over what the message asks for; docstrings name kinds and units.",
        python="mbs.load(5)",
    ),
    "I100": Explained(
        "An input is wrong",
        "An option or argument does not fit what it is given for.",
        "Do what the message says; it names the argument and what is known there.",
        python="mbs.simulate(mbs.loads(PENDULUM), t_end=0.1, backend='fortran')",
    ),
    # --- expressions
    "E101": Explained(
        "An expression cannot be read",
        "A character, operator, number or parenthesis stands where none can stand. The caret shows where.",
        "Write products with *, powers with ^, decimals with a point; close each parenthesis; quote an expression with "
        "a comma inside [...] or {...}.",
        pendulum(("mass: m", "mass: 2*")),
    ),
    "E102": Explained(
        "A function is not known, or has other arguments",
        "The name before ( is no function, or the number of its arguments is another one.",
        "Look the function up among those of the expression language; angles are in radians.",
        pendulum(("l: 0.5 m", "l: sine(0.5)")),
    ),
    "E103": Explained(
        "A unit is not known",
        "What stands behind a number is no unit, or cannot be one.",
        "Use the units of the expression language, such as kg, mm, deg, N/m; put a * between a number and a name.",
        pendulum(("m: 1 kg", "m: 1 kilos")),
    ),
    "E104": Explained(
        "An expression is too large",
        "Names, numbers, nesting and length of expressions have limits, so that no file can make the program hang.",
        "Give parts of the expression names under parameters or inputs; write numbers that a computer can hold.",
        pendulum(("0.5 m", "1e500 m")),
    ),
    "E105": Explained(
        "An expression has no real value",
        "A constant part divides by zero, takes the root of a negative number, or the like.",
        "Correct the numbers; where they depend on the state, start elsewhere.",
        pendulum(("0.5 m", "1/(2 - 2)")),
    ),
    "E106": Explained(
        "Quantities of different dimensions are added or compared",
        "A length is added to a mass, or a function wants a pure number and gets a length.",
        "Check the units of the parameters; divide by what makes the number pure.",
        pendulum(("-l, 0]", "-l - m, 0]")),
    ),
    # --- files
    "F101": Explained(
        "The model file cannot be read",
        "There is no such file, it is a folder, or it may not be read.",
        "Check the name and the folder; `multibody-sym new` writes a model to start from.",
        words=("check", "no_such_file.yaml"),
    ),
    "F102": Explained(
        "The file is not YAML as model files have it",
        "An indent, bracket, quote or colon is wrong, a key stands twice, or the file uses anchors or tags.",
        "Look at the line that is named and the one above; indent with blanks; quote text with : or # in it.",
        pendulum(("name: pendulum", "name: pendulum\nname: again")),
    ),
    "F103": Explained(
        "The file is no model file",
        "It does not begin with `multibody_sym: 1`, or is no map of keys.",
        "Write `multibody_sym: 1` in the first line.",
        pendulum(("multibody_sym: 1", "multibody_sym: 2")),
    ),
    "F104": Explained(
        "A table file is wrong",
        "The file of a table is missing, lies elsewhere than beside the model, or holds no two columns of numbers.",
        "Put it beside the model; two columns, arguments that grow.",
        pendulum() + "inputs: {F: {table: {file: missing.csv}}}\n",
    ),
    "F105": Explained(
        "A robot description is wrong",
        "The URDF file is no XML, or something in it has no meaning here.",
        "Correct the line that is named, or leave the element out.",
        words=("import", "robot.urdf"),
        file='<robot name="r"><link/></robot>\n',
    ),
}


# ----------------------------------------------------------------------------------------------------------------------
# Numbers of what is wrong in a model.


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
        "Write it; the reference lists the values that it takes.",
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
        "An expression contains an undeclared name",
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
        "A rope ends in the air, runs over one pulley twice, or leaves a drum on an unknown side.",
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


# ----------------------------------------------------------------------------------------------------------------------
# Numbers of what goes wrong after a model is read: solutions, runs, output, the command line, defects.


RESULTS: Final[dict[str, Explained]] = {
    # --- no solution
    "N100": Explained(
        "There is no solution",
        "The problem as declared has no solution, or none that is unique, for a reason without a number of its own.",
        "The message names the contradicting parts; `check` reports more about the model.",
        slider()
        + "constraints:\n  a: {type: expression, zero: x}\n  b: {type: velocity, zero: u_x - 2*t - 1}\n",
        ("simulate",),
    ),
    "N101": Explained(
        "Start values do not satisfy the constraints",
        "A loop does not close, or a rope is too short, with the start values that are known.",
        "Mark fewer values as known, start nearer to a position that closes, or correct lengths.",
        """\
multibody_sym: 1
name: too short
bodies: {rod: {mass: 1, inertia: {Izz: 1}, points: {end: [1, 0, 0]}}, ground: {points: {far: [5, 0, 0]}}}
joints: {A: {type: revolute, parent: ground, child: rod}}
constraints: {link: {type: distance, between: [rod.end, ground.far], value: 1}}
""",
        ("simulate",),
    ),
    "N102": Explained(
        "Nothing resists a motion",
        "A body without mass, or without inertia about the axis, is free to move: its acceleration has no value.",
        "Give it a mass or an inertia, or hold the direction.",
        pendulum(("mass: m, com: [0, -l, 0]", "mass: m")),
        ("solve",),
    ),
    "N103": Explained(
        "The position is singular",
        "In this position constraints depend on each other, as those of a stretched mechanism do.",
        "Start from a position beside it.",
        """\
multibody_sym: 1
name: dead centre
gravity: [0, -9.81, 0]
bodies:
  crank: {mass: 1, inertia: {Izz: 1}, points: {pin: [1, 0, 0]}}
  rod: {mass: 1, inertia: {Izz: 1}, points: {end: [2, 0, 0]}}
joints:
  A: {type: revolute, parent: ground, child: crank, q: a, initial: {q: 0, known: true}}
  B: {type: revolute, parent: crank.pin, child: rod, q: b, initial: {q: 0, known: true}}
constraints:
  tip: {type: expression, zero: cos(a) + 2*cos(a + b) - 3}
""",
        ("simulate",),
    ),
    "N104": Explained(
        "The closed form is too large",
        "A derivation in symbols went past its time or size.",
        "Choose a recursive formalism (newton_euler, composite_body), or raise --budget.",
        pendulum(),
        ("derive", "--budget", "1e-9"),
    ),
    "N105": Explained(
        "A number is not finite",
        "Values of the model are too large or too small, or a force has no slope in this state.",
        "Correct values and units, or start elsewhere.",
    ),
    "N106": Explained(
        "A rope would push",
        "The rope is declared as always taut, and in this state it would have to push.",
        "Say slack: true, or start where it is taut.",
        """\
multibody_sym: 1
name: pushed
bodies: {a: {mass: 1}, b: {mass: 1}}
joints:
  A: {type: prismatic, parent: ground, child: a, axis: x, q: x1, initial: {q: 0}}
  B: {type: prismatic, parent: ground, child: b, axis: x, q: x2, initial: {q: 1}}
forces: {F: {type: force, on: a, value: [1, 0, 0]}}
constraints: {string: {type: rope, path: [a, b]}}
""",
        ("solve",),
    ),
    "N107": Explained(
        "No state fulfils all laws",
        "With these values nothing that may act, stick or slide fulfils the laws of contact and friction together, as "
        "for bodies that jam (Painleve); or none was found, as where slip in space may begin in any direction.",
        "Lower the friction, or start from another state.",
    ),
    "N108": Explained(
        "The impact has no solution",
        "Nothing strikes, or the impulses that are asked for contradict each other or never end.",
        "Start where things move towards each other; correct the normal, or take another law.",
        other(BALL, ("0.1, 0]}}}", "0.1, 0], u: [0, 1, 0]}}}"))
        + "impact: closing\ncontacts: {c: {between: [ball.rim, ground.floor]}}\n",
        ("solve",),
    ),
    "N109": Explained(
        "No position of equilibrium was found",
        "From the start and from places around it none was found in which the system rests.",
        "Start nearer to one; look whether something drives the system on and on.",
        slider() + "forces: {F: {type: force, on: block, value: [1, 0, 0]}}\n",
        ("equilibrium",),
    ),
    "N110": Explained(
        "The range of rest is unknown",
        "What is varied does not end rest, or something moves as prescribed or rubs in a way that has no such range.",
        "Vary a force or coefficient on which rest depends.",
        slider(("k: 10 N/m", "F: 10 N")) + "forces: {F: {type: force, on: block, value: [0, F, 0]}}\n",
        ("equilibrium", "--vary", "m", "--least", "F"),
    ),
    "N111": Explained(
        "The state has no small motions",
        "In this state nothing moves, something slips or switches, or the motion does not repeat itself after the "
        "period.",
        "Linearise about another state, or give the true period.",
        slider() + "forces: {F: {type: force, on: block, value: [-k*x*(2 + sin(t)), 0, 0]}}\n",
        ("linearize", "--period", "1"),
    ),
    # --- runs, output, usage, defects
    "R100": Explained(
        "The run failed on the way",
        "Steps became too many or too small, a number too large, or no state was found in which the run goes on.",
        "The motion until then is kept. The message names the cause, its time and the attempts. The motion may go on: "
        "try other steps, tolerances or another method.",
        slider(("q: x}", "q: x, initial: {q: 1, u: 1}}"))
        + "forces: {F: {type: force, on: block, value: [k*x, 0, 0]}}\nsimulation: {t_end: 300}\n",
        ("simulate", "--backend", "python"),
    ),
    "R101": Explained(
        "The motion ends there",
        "The model has none beyond: a speed grows without bound, a motion drives into a stop, constraints contradict "
        "each other, a mass is used up, a rope comes off its wheel, or friction leaves no state.",
        "The motion until then is complete. End the run before, or change what the message names.",
        slider(("k: 10 N/m", "k: 10 N/m^3"), ("q: x}", "q: x, initial: {q: 1, u: 1}}"))
        + "forces: {F: {type: force, on: block, value: [k*x^3, 0, 0]}}\n",
        ("simulate", "--t-end", "3", "--backend", "python"),
    ),
    "O100": Explained(
        "The result cannot be kept",
        "Something was not written, for a reason without a number of its own.",
        "The message names the file and the reason.",
    ),
    "O101": Explained(
        "The file is there already, or is the model itself",
        "Commands never replace a file that they did not write, nor the model by a result.",
        "Choose another name with -o.",
        pendulum(),
        ("simulate", "-o", "model.yaml"),
    ),
    "O102": Explained(
        "The file cannot be written",
        "The folder is missing or read-only, or the disk is full.",
        "Choose another place.",
        pendulum(),
        ("simulate", "-o", "no/such/folder.csv"),
    ),
    "O103": Explained(
        "There is no C compiler, or it failed",
        "C was asked for, and no compiler was found, or what it printed is an error.",
        "Install one (gcc, clang, or pip install 'multibody-sym[compiler]') or set CC to its name; without --backend "
        "Python serves as well.",
    ),
    "O104": Explained(
        "A package is missing",
        "Plots, Parquet files and some integration methods need packages that are installed on request.",
        "Install what the message names, such as pip install 'multibody_sym[plot]'.",
    ),
    "U101": Explained(
        "The command line is wrong",
        "A command or option is misspelt, lacks its value, or two options say two things.",
        "Look at COMMAND --help.",
        pendulum(),
        ("check", "--jsno"),
    ),
    "U102": Explained(
        "These are no units to read",
        "--units has an unknown unit, two units of one quantity, or a pure number.",
        "Write units with commas between them, such as mm,deg,kN.",
        pendulum(),
        ("check", "--units", "mm,cm"),
    ),
    "U103": Explained(
        "Results of this kind are not written",
        "The ending of the name of a result selects its format, and this one is unknown.",
        "Take one of the endings that are listed.",
        pendulum(),
        ("simulate", "-o", "motion.xls"),
    ),
    "X100": Explained(
        "A defect of this program",
        "Something failed that should never fail, whatever the input.",
        "Please report it, with the file; MULTIBODY_SYM_DEBUG=1 shows where it happened.",
    ),
    "X101": Explained(
        "A defect of a generated program",
        "A generated program contradicts itself.",
        "Please report it, with the file.",
    ),
    "X102": Explained(
        "There is not enough memory",
        "The model or the table of a run is larger than memory.",
        "Ask for fewer samples, or write the run to a CSV file with -o: its rows are written as they come.",
    ),
    "X103": Explained(
        "Interrupted",
        "Ctrl-C ended the command.",
        "Nothing is wrong; rows of a run that were computed are kept.",
    ),
}


# ----------------------------------------------------------------------------------------------------------------------
# All pages of errors, by their numbers.


EXPLAINED: Final[dict[str, Explained]] = {**INPUTS, **MODELS, **RESULTS}
NEVER_ON_PURPOSE: Final = ("N105", "N107", "O100", "O103", "O104", "X100", "X101", "X102", "X103")
"""Numbers that no small file shows: they hang on the machine, on a defect, or on a file of some length."""
