"""The columns of ``Plan.chassis`` and of ``State.chassis``, of a multi-body vehicle.

The first ones are those of `_chassis_columns`: up to the tyres' coefficients, and up to the speed.
The height is here that of the sprung mass.
"""

from bridgegen.simulation.embedded.chassis._chassis_columns import SLIP
from bridgegen.simulation.embedded.chassis._chassis_columns import SPEED as _LAST

# Plan.chassis: the vehicle.
BEST = SLIP  # B·κ of the tyres' largest longitudinal force
MASS, SPRUNG = 29, 30  # kg, of all, and of the body
PUSH = 31  # N of all wheels per m/s² that is asked for: the mass, and the wheels' inertia
I_ROLL, I_PITCH, I_YAW = 32, 33, 34  # kg·m²
RADIUS, I_WHEEL, SLIP_LAG = 35, 36, 37  # m, kg·m², s: of the control of slip
K_TYRE, SHIFT = 38, 39  # N/m upwards, m/N: how far a side force moves the point of contact
K_JOINT, D_JOINT = 40, 41  # N/m, N·s/m: between body and axle, sideways
# The tyres' coefficients of camber.
D_Y3, H_Y3, V_Y3 = 42, 43, 44
V_YK3, V_YK4, V_YK5, V_YK6 = 45, 46, 47, 48
# Of the front axle; those of the rear axle follow.
AXLE = 49
TRACK, UNSPRUNG, I_AXLE = 0, 1, 2  # m, kg, kg·m² in roll
SPRING, DAMPER, BAR, CAMBER = 3, 4, 5, 6  # N/m, N·s/m, N·m/rad, rad/m
AXLE_COLUMNS = 7
MULTI_BODY = AXLE + 2 * AXLE_COLUMNS

# State.chassis: how it moves. Roll is positive to the right, pitch with the nose up.
ROLL, ROLL_RATE, PITCH, PITCH_RATE, SUNK, SINKS = range(_LAST + 1, _LAST + 7)  # SI, of the body
# Of the front axle; those of the rear axle follow. Its sideways speed, how far and how fast the
# tyres are pressed in, and how far it is off the body's middle.
AXLE_AT = _LAST + 7
LEAN, LEAN_RATE, ASIDE, PRESSED, PRESSES, OFF = 0, 1, 2, 3, 4, 5
AXLE_STATES = 6
SPIN = AXLE_AT + 2 * AXLE_STATES  # rad/s: front left, front right, rear left, rear right
STATES = SPIN + 4
# Memory of Runge–Kutta 4: a stage's states and their derivatives, and the sum of these.
STAGE, SLOPE, SUM = STATES, 2 * STATES, 3 * STATES
MOTION_OF_BODIES = 4 * STATES
