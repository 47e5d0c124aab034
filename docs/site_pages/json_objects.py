"""The objects of `--json`, command by command, with the meaning of each key; a test compares the printed keys."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from site_pages.markdown import block, code, plain, table

UNITS: Final = "unit of each coordinate, speed and other value that has one"
WITHHELD: Final = "components of reactions without a value, since constraints do not say where their forces act"
REASONS: Final = "why they are withheld"
OBJECTS: Final[Mapping[str, Mapping[str, str]]] = {
    "check": {
        "degrees_of_freedom": "number of degrees of freedom; null where there is no start",
        "rank": "number of independent constraint rows",
        "redundant": "rows that follow from others",
        "not_unique": "rows and joints whose forces are not unique",
        "dependencies": "which rows depend on which",
        "ambiguous": "ambiguous constraints, with their possible meanings",
        "ambiguous_forces": "the forces that are not unique, by their names in expressions",
        "agreement": "by formalism: how far it differs from the first, relative; 1e-12 is rounding",
        "theorems": "by theorem: how far it is missed, relative",
        "conserved": "the conserved quantities",
        "symmetries": "for each conserved quantity the symmetry that it follows from",
        "held": "coordinates that kept their given values when loops were closed",
        "assembled": "coordinates that were found when loops were closed",
        "shifts": "by how much given start values were changed",
        "shift": "the largest of these",
        "agrees": "whether all formalisms and theorems agree",
        "missing": "formalisms and theorems that do not, by name",
        "failure": "why there is no motion; null where there is",
        "hints": "probable oversights, with their places in the file",
        "withheld": WITHHELD,
        "withheld_reasons": REASONS,
        "doubles": "constraints that say the same twice",
        "units": UNITS,
        "states": "state of each contact, rope, stop and friction at the start",
        "verdict": "`one`, or `several` where the laws leave more than one motion at the start",
        "others": "states in the other motions",
    },
    "derive": {
        "method": "the method of derivation",
        "coordinates": "names of coordinates",
        "speeds": "names of speeds",
        "multipliers": "names of multipliers",
        "kinetic_energy": "T",
        "potential_energy": "V",
        "state_rates": "rates of the declared states, which are the last coordinates",
        "dissipation": "Rayleigh's function of dampers; null where there is none",
        "reactions": "reactions that are told",
        "mass_matrix": "M, row by row, as expressions",
        "forcing": "f in M u' = f + H^T lambda",
        "constraint_jacobian": "H",
        "constraint_forcing": "gamma in H u' = gamma",
        "letters": "the letters of names in formulas",
        "withheld": WITHHELD,
        "withheld_reasons": REASONS,
        "constants": "values of constants that formulas name",
        "definitions": "named sub-expressions",
        "equations": "the equations of motion, as text",
        "steps": "the steps of the derivation",
        "operations": "how many operations the equations take",
        "conserved": "with `--theorems`: conserved quantities with their symmetries",
        "units": UNITS,
    },
    "solve": {
        "impact": "with an `impact`: jumps of speeds, impulses, losses",
        "stages": "with `then`: stages after the first: `stage`, `begins`, `t`, `start`, and the keys of its solution",
        "coordinates": "value of each coordinate",
        "speeds": "value of each speed",
        "assembled": "coordinates and speeds that follow from the constraints: `value` and `expression`",
        "shifts": "by how much given start values were changed",
        "at_rest": "whether constraints leave no freedom, as those of a structure do",
        "accelerations": "by coordinate: `value` and `expression`",
        "rates": "by declared state: `value` and `expression` of its rate",
        "reactions": "by element and component: `value` and `expression`",
        "sums": "sums of contact forces that are unique together",
        "states": "state of each contact, rope, stop and friction",
        "directions": "in space: the direction of sliding",
        "verdict": "`one`, or `several` where the laws leave more than one motion",
        "others": "the other motions",
        "searched": "which states were looked at",
        "closing": "speeds of contacts that close at the start and strike",
        "at_limit": "for a state at its limit: the change beyond it",
        "needed": "least coefficients of friction of contacts with `enough`",
        "conditions": "conditions under which all this holds",
        "limits": "by condition: the consequence of its failure",
        "answers": "answers to `ask`: `value` and `expression`, and `error` of a number without one",
        "where": "letters of formulas, where loops leave no closed form: `value`, `expression` or `equation`, `says`",
        "not_unique": "rows whose forces are not unique",
        "withheld": WITHHELD,
        "withheld_reasons": REASONS,
        "notes": "omitted effects, with the reasons",
        "units": UNITS,
    },
    "equilibrium": {
        "positions": "positions of rest, each a map of coordinates",
        "stable": "whether each is stable; null where that is not decided",
        "free": "directions in which each may be moved and still rests",
        "beyond": "springs whose end lies beyond their other end in each",
        "complete": "whether all positions were found for certain",
        "cut_short": "whether the search was ended early",
        "guesses": "from how many positions it was looked",
        "speeds_left_out": "speeds that were taken as zero",
        "one_sided": "whether a force has no real value on one side of each",
        "closed": "contacts, ropes and stops that press or pull in each, with their states",
        "friction_left_out": "friction that might hold other positions",
        "errors": "how far the coordinates of each position may be off",
        "expressions": "coordinates of each position that have a formula in parameters",
        "sets": "how many sets of contacts, ropes and stops were tried closed, and how many there are",
        "units": UNITS,
    },
    "linearize": {
        "states": "names of states",
        "inputs": "names of inputs",
        "A": "A in x' = A x + B u",
        "B": "B in x' = A x + B u",
        "eigenvalues": "eigenvalues of A, each [real, imaginary]",
        "steady": "whether the state is an equilibrium or steady motion",
        "left_out": "states on which nothing depends",
        "held_inputs": "inputs that were held",
        "accelerations": "those in the state",
        "shifts": "by how much given start values were changed",
        "at": "the state",
        "driving_inputs": "inputs that drive a motion",
        "outputs": "names of the rows of `C` and `D`: declared outputs that depend on no state that is left out",
        "C": "the matrix C in y = C x + D w, by rows",
        "D": "the matrix D, by rows",
        "dt": "null; the time between samples (s) of a sampled one",
        "input_values": "the inputs in that state, by name (SI)",
        "units": UNITS,
    },
    "modes": {
        "about": "equilibrium or steady motion",
        "found": "whether the state was found beside the start",
        "at": "the state",
        "coordinates": "names of coordinates",
        "held": "coordinates that are held",
        "M": "mass matrix: values and expressions",
        "C": "matrix of rates",
        "K": "stiffness matrix",
        "modes": "normal modes",
        "frequencies": "angular frequencies",
        "periods": "periods",
        "characteristic": "the characteristic polynomial where roots have no formula",
        "stable": "whether small motions stay small",
        "conditions": "conditions of stability",
        "notes": "omitted effects, with the reasons",
        "eigenvalues": "each [real, imaginary]",
        "period": "with `--period`: that of the motion from the start",
    },
    "simulate": {
        "t": "times",
        "coordinates": "by coordinate: a value for each time",
        "speeds": "by speed: a value for each time",
        "outputs": "by output: a value for each time; null where it has none",
        "units": UNITS,
        "events": "events: `t`, `kind`, `element` and more",
        "final": "the last state: `t`, `coordinates`, `speeds`; `initial` takes it",
        "drift": "how far constraints, energy and quaternions are off",
        "friction_work": "work of friction, by element",
        "impact_losses": "energy lost in impacts",
        "energy_residual": "the change of energy that no work accounts for",
        "withheld": WITHHELD,
        "withheld_reasons": REASONS,
        "redundancy": "rows that depend on each other, and since when",
        "statistics": "steps, evaluations and the like",
        "start": "how the start was assembled",
        "interrupted": "whether Ctrl-C ended the run",
        "theorems": "with `--verify`: how far theorems are missed",
        "times": "with `--times`: seconds by stage of the run",
        "written": "the files that were written",
    },
    "animate": {
        "frames": "number of pictures",
        "t": "the time at which they end",
        "written": "the files that were written",
    },
    "live": {"written": "the files that were written"},
    "draw": {
        "written": "the files that were written",
        "title": "the title of the figure",
        "description": "the content of the figure, in a sentence",
        "size_mm": "width and height in mm",
    },
    "report": {"written": "the files that were written"},
    "sweep": {
        "runs": "number of runs",
        "computed": "how many of them were computed in this call",
        "failed": "how many failed",
        "failures": "by run: why, of the first ones",
        "varied": "names of the varied values",
        "results": "names of the columns that runs tell",
        "about": "units and kinds of the columns",
        "output": "the file of the table; null for none",
        "table": "without a file: the columns",
        "written": "the files that were written",
    },
    "export": {"to": "the language", "files": "the files that were written"},
    "new": {
        "file": "the file that was written",
        "example": "the example it is",
        "examples": "with `--list`: titles by name",
    },
    "import": {
        "model": "the model file's text",
        "file": "the file that was written; null for none",
        "speeds": "number of speeds",
    },
    "explain": {
        "number": "the number",
        "title": "the subject",
        "cause": "why it happens",
        "cure": "the remedy",
        "errors": "without a number: titles of all",
    },
}
_ERROR: Final = (
    '{"error": {"code": "model", "number": "M101", "message": "unknown key \'mas\'; did you mean mass?",\n'
    '           "where": {"file": "pendulum.yaml", "line": 5, "column": 16, "path": "bodies.bob.mas"}},\n'
    ' "errors": [..]}'
)


def json_objects() -> str:
    """Return the page."""
    head = f"""\
# JSON objects

Every command takes `--json` and prints one object on standard output, also for an error; text goes to standard error.
Keys are added freely and never renamed. Numbers are SI; a missing number is `null`. `schema` prints the schema.

## Errors

{block(_ERROR, "json")}
`code` is the kind of the error, `number` that of [its page](errors.md), `path` the place in the model. `errors` lists
all mistakes of a model file in its order; `error` is the first. Objects of commands that read a model have `hints`
where something in it was hardly meant.
"""
    parts = [head]
    for command, keys in OBJECTS.items():
        rows = [(code(key), plain(said) if "`" not in said else said) for key, said in keys.items()]
        parts.append(f"## {command}\n\n{table(('key', 'meaning'), rows)}")
    return "\n".join(parts)
