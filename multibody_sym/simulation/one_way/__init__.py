"""Motion of what holds one way only: a run is a chain of runs, each in one mode.

question                                            answered by
what holds at an instant, and what a switch does    decision (law problems of positions, speeds, accelerations)
which speeds stand still for good in a mode         held
a mode as a problem to integrate                    modes (each made and compiled once)
the run: from switch to switch                      chained
what friction took, and where                       account
"""
