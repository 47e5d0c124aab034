"""Answers to `ask`: expressions at the start; paths, times, speeds and extremes later on; values of parameters.

asked               each question by its kind, those first whose answers others name
uniform_motion      motions whose accelerations never change, in closed form
simulated_motion    all others, by runs
"""
