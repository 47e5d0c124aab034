"""How does a calculation become fast code?

    statements, program, programs, trace     straight-line calculations as data that verify themselves
    arithmetic, floats, interpreter, derivatives     their meaning, and their derivatives
    tree_passes, loops                       like bodies, and like values, as loops
    c_target, python_target, targets, target_layout     Programs as C and as Python, each able to test itself
    compiler, cache, native, loading         compiled once, kept, and called

In: Nodes. Out: Programs, their code, and functions. Knows no text and no integrators: who runs code hands over its
arguments.
"""
