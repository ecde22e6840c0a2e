"""Flights in interval arithmetic hold the exact ones, in 200-bit balls, for every damping."""

import numpy as np
from flint import arb, arb_mat, ctx

from vibroimpact.single_impact.enclosed_flight import flight

ctx.prec = 200


def exact_flow(w, zeta, drive, load, duration):
    """The flow of x'' + 2 zeta w x' + w^2 x = drive cos psi + load: (x, v, cos psi, sin psi, 1)."""
    generator = arb_mat(
        [
            [0, 1, 0, 0, 0],
            [-w * w, -2 * zeta * w, drive, 0, load],
            [0, 0, 0, -1, 0],
            [0, 0, 1, 0, 0],
            [0, 0, 0, 0, 0],
        ]
    )
    flow = (generator * duration).exp()
    return [[flow[i, j] for j in range(5)] for i in range(2)]


def test_flights_are_enclosed_through_every_neighbourhood():
    random = np.random.default_rng(11)
    rows = []
    for k in range(240):
        natural, omega = 10.0 ** random.uniform(-2, 1), 10.0 ** random.uniform(-1, 0.7)
        zeta = random.choice([0, 0, 1e-12, 1e-6, 0.01, 0.5, 1 - 1e-8, 1, 1 + 1e-7, 1.5, 30])
        if k % 6 == 0:
            omega = natural
        elif k % 6 == 1:
            omega = natural * (1.0 + random.choice([1e-15, 1e-12, 1e-8, 1e-3, -1e-5]))
        elif k % 6 == 2:
            omega = natural / random.integers(1, 5)
        elif k % 6 == 3:
            natural = 0.0
        rows.append((natural, zeta, 1.3, random.choice([0.0, -0.7]), omega))
    columns = np.array(rows).T
    for n in (1, 3):
        enclosed = flight(n, *columns)
        for k, row in enumerate(rows):
            natural, zeta, force, static, omega = (arb(float(value)) for value in row)
            w, drive, load = natural / omega, force / omega**2, static / omega**2
            body = exact_flow(w, zeta, drive, load, 2 * n * arb.pi())
            for mine, exact in (
                (enclosed.c11, 1 - body[0][0]),
                (enclosed.a12, body[0][1]),
                (enclosed.a21, body[1][0]),
                (enclosed.c22, 1 - body[1][1]),
                (enclosed.gx.re, body[0][2]),
                (enclosed.gx.im, -body[0][3]),
                (enclosed.gv.re, body[1][2]),
                (enclosed.gv.im, -body[1][3]),
                (enclosed.hx, body[0][4]),
                (enclosed.hv, body[1][4]),
            ):
                lo, hi = arb(float(mine.lo[k])), arb(float(mine.hi[k]))
                # The exact value is itself a ball.
                assert not exact < lo, row
                assert not exact > hi, row
                size = max(1.0, float(drive), abs(float(exact)))
                assert mine.hi[k] - mine.lo[k] <= 1e-11 * size, row
