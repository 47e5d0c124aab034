"""What there is to see of a system: shapes and symbols on its bodies, and what runs between them, as data.

`scene_of` makes a `Scene` of what is declared, no geometry added; `Scene.at` places it at a state. Lengths are in
metres and in space; how large a symbol is on a page, and where letters go, is the affair of `drawing`.
"""
