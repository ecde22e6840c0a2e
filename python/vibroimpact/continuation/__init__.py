"""Pseudo-arclength continuation of any smooth problem F(u, p) = 0: it knows no impacts.

A problem gives residual, derivatives and test functions (`newton.Problem`); what a solution means
is known to the problem only. `follow` traces a branch with its special points, `curves` a curve of
special points in two parameters. Sources and formulas: orbits page.
"""
