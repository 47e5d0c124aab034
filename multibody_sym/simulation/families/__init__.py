"""Runs that differ in numbers alone: resolved and compiled once, their starts looked at together.

A `Family` has a `Layout`, which knows where each number of a plain mechanism comes from. What its quick look does not
clear, and systems with what holds one way only, are resolved and started one by one as `simulate` does; loops are
closed by Programs.
"""
