"""Programs: a mechanism's equations as straight-line code with named, shaped inputs and outputs.

In: a Mechanism and the name of a formalism. Out: Programs of (t, q, u, parameters, inputs): the rates of a state with
the multipliers (`system`), the same stabilised to index 2 (`index_2`), mass matrix, inverse and hybrid dynamics
(`tree`), outputs, energies and switching functions (`quantities`), and all joints' wrenches (`reactions`). Chains of
like bodies are written as loops over kinds (`like_bodies`, `scanned`), so that a thousand links cost one link's code.

The formalism runs once over Nodes; what it computes is what gets printed, differentiated and compiled. Imports
formalisms and inertia; knows no target language.
"""
