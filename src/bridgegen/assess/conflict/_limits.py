"""All limits of the conflict analysis, each with its unit and source.

Those that other stages share come from ``bridgegen.base.physics``.

"Ours" marks values without a source. Private for the reason given in ``_codes``.
"""

import math

import numpy as np

from bridgegen.base.physics import CAREFUL_BRAKING, CAREFUL_JERK, CAREFUL_REACTION

# --- Collision course and near miss -------------------------------------------------------------

HORIZON = 4.0
"""Longest time to contact of a collision course [s]. Source: van der Horst and Hogema (1993),
Time-to-collision and collision avoidance systems: 4 s separates drivers who find themselves in
danger from those who are in control."""
SERIOUS_TTC = 1.5
"""Largest time to collision of a near miss [s]. Source: van der Horst and Hogema (1993)."""
SERIOUS_DECELERATION = 3.35
"""Least deceleration that a near miss needs [m/s²]. Source: Archer (2005), Indicators for traffic
safety assessment and prediction, KTH: deceleration rate to avoid a crash (DRAC) above the 3.35 m/s²
(11 ft/s²) of AASHTO."""
# By 3.35 m/s² alone, four exports of `reference` counted that brake by 4.5 m/s² and stop 2.7 m
# before the ambulance's way. The 5 m/s² at 5 m/s is unconfirmed: ISO 15622 was not at hand.
BRISK_SLOW, BRISK_FAST = (5.0, 5.0), (20.0, 3.5)
"""Speed of the ego [m/s], and deceleration up to which braking is no emergency [m/s²]; linear
between the two. Source: ISO 15622:2018, the average over 2 s by which adaptive cruise control, a
comfort function, may brake."""
CLOSE_CALL = 0.5
"""Distance below which two bodies have a near miss even after emergency braking was needed [m].
Ours."""
MOVES = 0.5
"""Least speed of an ego with a near miss [m/s]: others pass a slower one. Ours."""
GUIDANCE = 6.0
"""Horizon of the closest encounter at constant velocity [s]. Ours."""
GUIDANCE_STEP = 5
"""Number of instants from one closest encounter that is computed to the next. Ours."""
NEAR, SOON = 5.0, 3.0
"""Scales of nearness in space [m] and time [s]. Ours."""
FINEST = 0.05
"""Shortest time step of a prediction along paths [s]. Ours."""
HALVINGS = 10
"""Number of times that the last step of a prediction is halved: to 0.05 ms. Ours."""
JUMPS = 5.0
"""Difference between a body's motion by its positions and its speed beyond which it was teleported
[m/s]: lane changes of scripted bodies reach 3 m/s sideways. Ours."""

# --- Contact and type ---------------------------------------------------------------------------

# As `elementary` has it, without the compiler, which is slow to import.
FLUSH = 0.13917310096006544  # sin 8°
"""Sine of the angle between two edges below which they meet flush [1]; at a larger one a corner
meets an edge. Ours."""
STANDS = 0.1
"""Speed below which a body stands [m/s]. Ours: below the resolution of recorded speeds, 0.36
km/h."""
CREEPS = 0.5
"""Speed below which a body that brakes at ``COMFORT`` or harder has all but stopped [m/s]: it does
not drive into another one. Ours: it stops within 0.2 s and 4 cm."""
STOOD = 0.5
"""Standing time from which on a body has not stopped because of the conflict [s]. Ours."""
SAME_WAY = 0.8191520442889918  # cos 35°
"""Cosine of the angle between the headings of bodies that go the same way [1]; its negative:
against each other. Ours: lane changes reach 25° at walking speed, turns begin at 60°."""
TURNS = math.radians(10.0)
"""Change of heading within ``TURN_TIME`` beyond which a body turns [rad]. Ours."""
TURN_BEGINS = math.radians(3.0)
"""Change of heading beyond which a body turns if it changes by twice ``TURNS`` in all within half
of ``TURN_TIME`` [rad]. Ours."""
TURN_TIME = 4.0
"""Time over which a turn is recognised [s]: a quarter turn of 8 m radius takes 4 s at 3 m/s.
Ours."""
FRONT_PART = 0.15
"""Share of a body's length from its leading end [1]: one that is met there at its side is met with
its front. Ours: about the overhang of a car."""
PUSHES = 0.3
"""Speed below which a body that moves into another does not strike it [m/s]. Ours."""

# --- The careful driver -------------------------------------------------------------------------

REACTION = CAREFUL_REACTION
"""Reaction time, from the risk until braking begins [s]. Source: UN R157, Annex 3, performance
model."""
BRAKING = CAREFUL_BRAKING
"""Deceleration of the careful driver [m/s²]. Source: UN R157, Annex 3, performance model: 0.774
g."""
JERK = CAREFUL_JERK
"""Jerk with which the careful driver's braking builds up [m/s³]: 0.774 g in 0.6 s. Source: UN R157,
Annex 3, performance model."""
COMFORT = 3.0
"""Deceleration that one may ask of others [m/s²]. Source: UN R79, 5.6.4.7: a lane change must not
force the vehicle behind to more than 3 m/s²."""
HEADWAY, HEADWAY_RISE, MOST_HEADWAY = 1.0, 3.6 / 100.0, 2.0
"""Time gap that a careful driver keeps [s], its increase with speed [s/(m/s)], and its largest
value [s]: 1 s, and 0.1 s more per 10 km/h, up to 2 s. Source: UN R157, 5.2.3.3 (1.2 s at 20 km/h,
1.6 s at 60 km/h)."""
OPENING = 0.4
"""Deceleration of a careful driver who opens a gap that is too short when a scenario begins, or
when the other comes [m/s²]: with the foot off the accelerator. Source: European Commission,
JRC-FSM."""
OPENS_TO = 0.8
"""Share of the speed of the vehicle ahead down to which a careful driver opens a gap [1]. Ours."""
BEND_SHARE = 0.6
"""Share of the grip that a careful driver uses in a bend [1]; four fifths remain for braking (the
friction circle). Ours: a wet road (5 m/s²) leaves 3 m/s² across, at which drivers take
junctions."""
EVIDENT_EVERY = 0.1
"""Interval between two checks whether two bodies are on a collision course [s]. Ours."""
UNSURE = 0.5
"""Longest interruption of a collision course that is ignored [s]. Ours: a corner that would touch
for less than a step of the prediction, or a body that speeds up."""
DOUBTS = 2.0
"""Time to contact within which a careful driver does not trust that another stops [s]. Source: the
careful driver of UN R157, Annex 3, who reacts to a time to collision below 2 s."""
SYSTEM_REACTION, SYSTEM_BRAKING = 0.35, 6.0
"""Reaction time [s] and deceleration [m/s²] with which an automated system must avoid a cut-in.
Source: UN R157, 5.2.5.2."""
LATERAL_SEEN = 0.72
"""Time for which a cutting-in vehicle's lateral motion must have been visible [s]. Source: UN R157,
Annex 3."""
LATERAL_MOVE, JUST_BEFORE = 0.01, 0.2
"""Approach [m] within the time before [s] beyond which a body moves sideways: 1 cm in 0.2 s.
Ours."""
AHEAD_BY = 0.01
"""Distance by which a braking body may be farther ahead than without braking, and still avoid the
other by braking [m]. Ours: rounding."""
BRAKES_FOR = 20.0
"""Longest braking that is computed [s]: from 60 m/s at ``COMFORT``. Ours."""

# --- Obstruction ---------------------------------------------------------------------------------

MARGIN = 0.5
"""Distance to the strip that a body sweeps within which another is in its lane [m]. A car of 1.9 m
on a lane of 3.5 m has 0.8 m to each side, and a cut-in counts from 0.3 m beyond the marking on.
Source: UN R157, 5.2.5.2."""
MARGIN_ON_FOOT = 1.0
"""``MARGIN`` for pedestrians, cyclists and animals [m]. Source: StVO § 26, ECE pedestrian test
protocols brake for persons about to step into the path; the metre is ours."""
HARD = 5.0
"""Deceleration from which on braking needs a reason [m/s²]. Source: UN R157, 5.3.1: more than 5
m/s² is an emergency manoeuvre; UN R152: an emergency braking system demands 5 m/s² at least."""
TOO_CLOSE = 0.9
"""Time gap below which a follower is too close [s]. Source: BKatV, annex, 12.5 to 12.7, above 80
km/h: fined below half of half the speedometer, a quarter of the km/h in metres."""
JUST_NOW = 3.0
"""Time before a contact within which a body's actions count [s]. Ours: lane changes take 3 to 6
s."""
LATELY = 1.0
"""Time before two bodies meet over which their steering is compared [s]: of two that changed
course, the one that steered more came into the way of the other. Ours."""
ASIDE = 0.7
"""Lateral movement within ``JUST_NOW`` from which on a body has changed its course [m]. Ours: about
the room to the marking."""
OFF_LANE = 1.75
"""Distance of the reference point from the route beyond which a body has left its lane [m]: half of
a lane of 3.5 m. Ours."""
ALIKE = 0.7
"""Least cosine, in size, of the angle between two approaches of the same road [1]. Ours: 45°."""
AHEAD = 2.0
"""Distance that a stopping ego keeps to what is in its way [m]; what is nearer than that and the
way in which `REACTION` and braking by `HARD` stop it is a reason to brake hard. Ours."""

# --- Lights and crosswalks ----------------------------------------------------------------------

LINE_REACH = 3.5
"""Largest lateral distance at which a body crosses its own stop line or its prolongation [m];
farther aside it crosses another lane's. Ours: a lane's width."""
SIGHT = 60.0
"""Largest distance before its stop line at which a light holds a body [m]. Ours."""
LOOKED_BACK = 10.0
"""Time before a conflict in which running a red light, and an indicator, counts [s]. Ours."""
JUNCTION = 40.0
"""Distance behind its stop line up to which a light decides on conflicts [m]. Ours: the size of a
large junction."""
SLOWED = 0.75
"""Share of its speed to which one that indicates has slowed down if others may trust that it turns
off. Ours."""
CROSSWALK_MARGIN = 0.5
"""Extension of crosswalks along the route [m]. Ours."""
KERB = 1.0
"""Extension of crosswalks across the route [m]: pedestrians waiting at the kerb. Ours."""

# --- Lane and road, passing ----------------------------------------------------------------------

# The front axle and the corners do not count: in a turn a body sweeps more than its lane.
LINE_MARGIN = 0.5
"""Distance of a rear wheel beyond its lanes' border from which on a vehicle has left them [m]."""
EDGE_MARGIN = 0.2
"""Distance of a rear wheel beyond the road's edge from which on a vehicle has left the road [m]."""
WALKING_PACE = 7.0 / 3.6
"""Speed below which an ego may pass closer [m/s]. Source: StVO § 5 (4) has no such speed; the case
law on walking pace (Schrittgeschwindigkeit) says 4 to 7 km/h."""
PASSES = 0.5
"""Speed difference below which an ego does not pass [m/s]. Ours."""
PASSED_AHEAD = 40.0
"""Distance to what is in its lane below which a driver moves aside to pass it [m]. Ours: a lane
change at 50 km/h takes 3 s."""
PASSED_BESIDE = np.array([2.0, 1.5])
"""Least clearance to who is passed, outside towns and in them [m]. Source: StVO § 5 (4)."""
PASSED_BESIDE.setflags(write=False)
CLOSE, CLOSE_TIME = 0.5, 0.03
"""Clearance in passing below which it is a failure [m], and its increase with the speed difference
[s]: 0.5 m, and 0.03 m more per m/s by which the ego is faster; up to ``PASSED_BESIDE``, it is noted
only. 1 m at 60 km/h is what Queensland asks for up to there (Transport Operations (Road Use
Management) Regulation, 144A); the 0.5 m are ours."""
CLEAR_ZONE = 4.5
"""Distance beyond the road's edge at which a solid obstacle is assumed [m]: what is nearer is
protected (RPS 2009). A car brakes up to there. That there is an obstacle is ours."""
