"""From mode to mode: what holds one way only opens, closes, sticks, slips and strikes.

    law_values              what laws ask at an instant, in numbers; forces that are not unique
    decision, impact        what holds then, and what a switch does
    flights, rare_contacts, jams     bounces without end, thin bars and corners, friction that jams
    known_switches          whether a switch does what it did before
    modes, every            a mode as a problem to integrate; whether one set of Programs serves all
    prepared                what runs of a system share and remember, and what they decide at switches
    mode_run, legs          the run from leg to leg (`next_leg`), and what a finished one is asked
"""
