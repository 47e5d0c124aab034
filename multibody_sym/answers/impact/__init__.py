"""What an impact does: jumps of speeds, impulses of contacts and in joints, in numbers and in closed form.

question                                     answered by
the mechanism of the impact, solved          resting
what is told                                 record
all of it                                    answer

An impact is the mechanism at rest with the jumps of its rows for gamma: it is solved as any other instant is.
"""
