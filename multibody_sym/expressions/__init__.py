"""Text and Nodes: the parser, units of measurement, and the printer of the model's own language."""
