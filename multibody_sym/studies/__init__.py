"""Studies: many runs of one system, whose parameters and start values are varied, as one table.

In: a System and a `Plan`, which tells the values of a run by its number alone. A `Task`, all that a worker needs, makes
`Rows` of a span of numbers: what a run ended with, its extremes and events, or the reason why there is none. Rows go
to a `Journal` beside the table as they come, from whichever worker, and from there into the table in their order. A
study that was killed reads its journal and computes what is missing.

The bits of a row hang on its values alone: not on its neighbours, nor on who computed it, nor on how often a study was
begun anew.

It knows nothing of commands, and nothing of what people read of one run (`writing`).
"""
