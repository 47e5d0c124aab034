"""Programs: a mechanism's equations as straight-line code with named, shaped inputs and outputs.

In: a Mechanism and a formalism. Out: Programs of (t, q, u, parameters, inputs, modes): the rates of a state with the
multipliers, corrections onto the constraints, inputs and energies (`system`); the same with constraints as part of the
equations, of index 2 (`index_2`); outputs and what may end a step (`quantities`, of which joints' wrenches are
`reactions`); mass matrix, inverse and hybrid dynamics (`tree`). Where many bodies are of few kinds (`like_bodies`), the
code is a loop over each kind (`scanned`), and their written numbers are data (`literals`): a thousand links cost the
code of one.

A formalism runs once over Nodes; what it computes is what gets printed, differentiated and compiled.

Imports formalisms, inertia and what lies below; knows no target language.
"""
