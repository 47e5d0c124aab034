"""Kinematics and forces of a mechanism, written once over three scalars: float, Node and sympy expression."""
