"""Numbers of what is wrong before a model is known: arguments, expressions, files."""

from __future__ import annotations

from typing import Final

from multibody_sym.cli.explained.page import Explained, pendulum

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
