"""Strokes, letters and places on a page, and the files that they become.

    picture   lines, arcs, arrows, hatching and letters
    layout    places of labels and dimension lines, clear of each other
    files     SVG and TikZ; PNG and PDF by matplotlib
"""
