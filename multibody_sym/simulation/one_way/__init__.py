"""Motion of what holds one way only: a run is its legs, each in one mode.

question                                            answered by
what laws ask at an instant, in numbers             facts
what holds then, and what a switch does             decision (impacts, accelerations), settling (positions, speeds)
whether it does what it did before                  known_switches
forces that are not unique: which ones a run has    basic
which speeds stand still for good in a mode         held
a mode as a problem to integrate                    modes (each made and compiled once)
what a run decides at its switches                  switches
what runs of a system share, and remember           prepared, switch_memory (in C, too)
the run: from leg to leg                            mode_run (next_leg)
what a finished run is asked                        legs
what friction took, and where                       account
"""
