"""Period n-1 motions in 200-bit arithmetic, by flights that share no code with the package."""

from flint import arb, ctx

import vibroimpact as vi
from vibroimpact.reference.flight import System as ExactSystem
from vibroimpact.system import SYMBOLS

ctx.prec = 200
PAPER = {"mass_ratio": 0.6, "frequency_ratio": 2.0, "restitution": 0.8, "gap": 0.5}
SHORT = {name: symbol for symbol, name in SYMBOLS.items()}


def paper_system(omega, moment, **changes):
    return vi.System(**(PAPER | {"drive_frequency": omega, "moment_amplitude": moment} | changes))


def random_system(random, **changes):
    values = {
        "mass_ratio": 10.0 ** random.uniform(-1.5, 1.0),
        "frequency_ratio": random.uniform(0.2, 3.0),
        "restitution": random.uniform(0.0, 1.0),
        "gap": random.uniform(-0.5, 0.8),
        "drive_frequency": random.uniform(0.3, 3.0),
        "damping": (random.choice([0.0, 0.02, 0.4, 1.0, 1.7]), random.choice([0.0, 0.05, 1.3])),
        "moment_amplitude": random.uniform(-2.0, 2.0),
        "force_amplitude": random.choice([0.0, 0.4, 1.5]),
        "phase": random.uniform(-3.0, 3.0),
        "contact": str(random.choice(["oblique", "oblique", "direct"])),
    }
    return vi.System(**(values | changes))


def exact_residual(motion):
    """Error of periodicity in 200-bit arithmetic, and the size of the state."""
    system = motion.system
    exact = ExactSystem.parse(
        {SHORT[name]: getattr(system, name) for name in SHORT}, system.contact
    )
    x1, v1, v2, phase = (arb(value) for value in motion.state)
    kappa = x1.cos() if exact.oblique else arb(1)
    x2 = exact.tip(x1) - arb(system.gap)
    mbar, r = arb(system.mass_ratio), arb(system.restitution)
    # (19), (20).
    q = mbar + kappa**2
    w1 = ((mbar - r * kappa**2) * v1 + (1 + r) * kappa * v2) / q
    w2 = ((1 + r) * mbar * kappa * v1 + (kappa**2 - r * mbar) * v2) / q
    time = 2 * motion.m * arb.pi() / arb(system.drive_frequency)
    first, second = exact.bodies()
    end = (*first.state(time, x1, w1, phase), *second.state(time, x2, w2, phase))
    start = (x1, v1, x2, v2)
    off = max(abs(float(a - b)) for a, b in zip(end, start, strict=True))
    return off, max(1.0, *(abs(float(a)) for a in (x1, v1, x2, v2, w1, w2)))
