"""Numbers of what goes wrong after a model is read: solutions, runs, output, the command line, defects."""

from __future__ import annotations

from typing import Final

from multibody_sym.cli.explained.page import BALL, Explained, other, pendulum, slider

RESULTS: Final[dict[str, Explained]] = {
    # --- no solution
    "N100": Explained(
        "There is no solution",
        "The problem as declared has no solution, or none that is unique, for a reason without a number of its own.",
        "The message tells what contradicts what; `check` tells more about the model.",
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
        "The range of rest cannot be told",
        "What is varied does not end rest, or something moves as prescribed or rubs in a way that has no such range.",
        "Vary a force or coefficient on which rest depends.",
        slider(("k: 10 N/m", "F: 10 N")) + "forces: {F: {type: force, on: block, value: [0, F, 0]}}\n",
        ("equilibrium", "--vary", "m", "--least", "F"),
    ),
    "N111": Explained(
        "Small motions cannot be told there",
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
        "What was computed until then is kept. The message names what and when, and what was tried; the motion may go "
        "on there: other steps, tolerances or another method tell.",
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
        "--units names what is no unit, two units of one quantity, or a pure number.",
        "Write units with commas between them, such as mm,deg,kN.",
        pendulum(),
        ("check", "--units", "mm,cm"),
    ),
    "U103": Explained(
        "Results of this kind are not written",
        "The ending of the name of a result tells its format, and this one is not known.",
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
