"""Plots: panels of curves as data, and figures of them by matplotlib.

What comes in are names, numbers and units as they are to be read; nothing here knows runs or mechanisms.
"""
