"""How formulas are written where they are typeset: MathML, and lines that fit the page."""
