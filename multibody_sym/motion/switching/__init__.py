"""From mode to mode: what holds one way only opens, closes, sticks, slips and strikes.

    mode_run          the run from leg to leg: a rope becomes slack, a contact opens
    legs              legs of a finished run, their causes, impacts and events
    decision          the state that follows a switch
    impact            impacts of a run: which law holds, one smooth contact alone, when bounces come to rest (the same
                      in C: templates/c/contact_impacts.c)
    jams              friction that jams (Painleve)
    law_values        what laws ask at an instant, in numbers; forces that are not unique
    law_mechanism     whether one set of Programs serves all modes; sides of thin bars, tips that meet
    modes             a mode as a problem to integrate
    prepared          what runs of a system share and remember; switches that were decided before
"""
