"""Physical constants that several stages share, each stated once, with its unit and source.

Kernels freeze them; ``compilation.sources`` counts this module as a source of theirs.
"""

GRAVITY = 9.81
"""Gravitational acceleration [m/s²]."""

DRY_FRICTION = 0.85
"""Peak friction of a tyre on dry asphalt [1], 0.8 to 0.9.

Source: Wong, Theory of Ground Vehicles, table 1.3."""

GRIP = DRY_FRICTION * GRAVITY
"""Largest acceleration that a tyre gives on a dry road, in any direction [m/s²]."""

MOST_LATERAL = 4.0
"""Lateral acceleration that drivers rarely exceed [m/s²].

Source: Mitschke and Wallentowitz, Dynamik der Kraftfahrzeuge."""

HARD_BRAKING = 4.9
"""Deceleration from which on braking is hard [m/s²]. Source: paper, Table I."""

CAREFUL_REACTION = 0.75
"""Reaction time of a careful driver, from the risk until braking begins [s].

Source: UN R157, Annex 3, performance model."""

CAREFUL_BRAKING_G = 0.774
"""Largest deceleration of a careful driver [g]. Source: as for ``CAREFUL_REACTION``."""

CAREFUL_BRAKING = CAREFUL_BRAKING_G * GRAVITY
"""Deceleration of a careful driver in an emergency [m/s²]; source as of `CAREFUL_BRAKING_G`."""

CAREFUL_JERK = 12.65
"""Jerk with which a careful driver's deceleration rises, to its most in 0.6 s [m/s³].

Source: as for ``CAREFUL_REACTION``."""
