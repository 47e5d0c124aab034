"""What an impact does: jumps of speeds, impulses of contacts and in joints, in numbers and in closed form.

question                                     answered by
what strikes, in which mode                  analysis/struck (numbers)
by how much each row jumps, in symbols       courses
the mechanism of the impact, solved          resting
under which conditions                       conditions
about which points bodies turn               centres
what holds just after                        asked
what is told                                 record
all of it                                    answer
step by step                                 worked

An impact is the mechanism at rest with the jumps of its rows for gamma: it is solved as any other instant is.
"""
