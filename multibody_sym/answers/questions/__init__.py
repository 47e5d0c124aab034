"""Answers to `ask`: at the start, of what happens later, and of values for which something holds.

    naming              one answer in the question of another: which comes first
    asked               each question by its kind
    uniform_motion      motions whose accelerations never change, in closed form
    simulated_motion    paths, times, speeds and values from runs; `in_numbers`, what they tell of a question
    extremes            the largest and least value, and when
    courses             coordinates as formulas of time; `later_forms`, closed forms of moments, values and extremes
    along_courses       formulas of one variable and where something happens; `energy_courses`, speeds by energy
    timed_courses       speeds where time and speed are in the acceleration, by integrals
    decoupled           coupled linear equations of motion taken apart into such of one unknown
    finding             zeros of a function of one number; `found_values`, values for which an equation holds
"""
