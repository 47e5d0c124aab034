"""How does a calculation become fast code?

    program, statements    straight-line calculations as data that verify themselves, operations as C performs them, the
                           interpreter; assign, call, solve, scan
    programs               the set that describes one system in motion
    trace                  Programs recorded while expressions are built
    derivatives            derivatives of Programs
    tree_passes, loops     like bodies, and like values, as loops
    c_target, list_target  Programs as C, and as Python and JavaScript, which have lists: the files of an export
    octave_target          Programs as functions of Octave and MATLAB, for trees of few bodies
    fmu_target             FMUs: description in XML, sources, archive
    replay                 Programs over the scalars of other tools; functions of CasADi and JAX
    target_layout          names in exports, templates filled in, samples and tolerance of their self test
                           (templates/c/selftest.c.in)
    runtime_constants      numbers that C and Python share
    backend                C, native or Python: the user's choice; languages of `export`
    loading, cache         compilers found, Programs compiled once and kept
    native                 the C side seen from Python; calls for one state, or many on threads

In: Nodes. Out: Programs, their code, and functions. Knows no text and no integrators: who runs code hands over its
arguments. The integration loop in C is in templates/c; `runtime.c` begins with the map of its units.
"""
