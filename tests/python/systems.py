"""Systems that several tests look at."""

import vibroimpact as vi

# Han, Jin & Hu (2004), section 4: one impact per drive period, without friction.
PAPER = vi.System(
    mass_ratio=0.6,
    frequency_ratio=2.0,
    restitution=0.8,
    gap=0.5,
    drive_frequency=1.8,
    moment_amplitude=1.0,
)
# Several impacts in every ten periods, with friction.
ROUGH = PAPER.replace(drive_frequency=1.545, friction=0.5)
# Fig. 9(3) there: a 4-5 and a 6-7 motion coexist.
COEXISTING = PAPER.replace(drive_frequency=1.5752, friction=0.5)
# Fig. 7(c) there: complete chatter at low drive frequencies.
LOW = PAPER.replace(drive_frequency=1.0, damping=(0.1, 0.1), force_amplitude=1.5)
# Chatter, slide, stick and release in every drive period.
STICKY = PAPER.replace(
    drive_frequency=0.25,
    restitution=0.3,
    damping=(0.1, 0.1),
    moment_amplitude=3.0,
    force_amplitude=1.5,
    friction=0.3,
)
