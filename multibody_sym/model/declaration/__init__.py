"""What the user said: elements as frozen records whose fields are the keys of a file, gathered in a System.

    values       what one field may hold: numbers, directions, words; read from what users write, written back
    fields       fields, and elements made of them: one class is the Python call, the YAML map and their errors
    parameters, bodies, joints, forces, constraints, tables, settings       the elements
    steps, joint the elementary motions that joints are made of; what all joints have
    system       a System: all that is declared under one name
    file_tree    the tree that a file holds, with `repeat` written out, and back
    doors        how public functions look at their arguments

Nothing here is resolved: names are text, poses and masses are as given. Imports expressions and scalars.
"""
