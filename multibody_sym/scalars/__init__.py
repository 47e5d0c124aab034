"""Scalars: the Node, functions over float, Node and sympy alike, exact derivatives, and the door to sympy."""
