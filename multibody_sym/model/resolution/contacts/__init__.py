"""Contacts: which skins of two bodies meet, and the rows along which they push, rub and roll.

    skins         what names of bodies, surfaces and points stand for: corners, ends, rims
    elements      contacts as elements that hold one way only
    samples       what an expression of parameters is worth at their sample values
"""
