"""Writing: what people read of derivations, answers, checks and runs.

In: records from below (SymbolicEquations, Solution, CheckReport, Linearization, Equilibrium, Trajectory). Out: text, of
derivations LaTeX and the data of `--json` too (`derivation`). One file for each kind of record: `solution`, `check`,
`linearization`, `statics` (positions of equilibrium), `rest` (ranges of rest), `run_summary`; `redundancy`, `shifts`
and `withheld` say in words what several of them tell: constraints left over, start values changed, reactions that are
not determined. `progress` draws the bar of a run that lasts.

What is told was found below: here it is put into words. Only commands import this.
"""
