"""Scalars: the Node, functions over float, Node and sympy alike, exact derivatives, and the door to sympy."""

from multibody_sym.scalars import pickling

pickling.register()
