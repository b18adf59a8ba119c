"""The columns of ``Plan.chassis`` and of ``State.chassis``, of a vehicle with dynamics.

Forces are per mass [m/s²]: a tyre's stiffness is taken to be proportional to its load, so a
vehicle's mass has no effect on its motion.
"""

# Plan.chassis: the vehicle.
TO_FRONT, TO_REAR = 0, 1  # m, from the centre of gravity to the axles
HEIGHT = 2  # m, of the centre of gravity
AGILITY = 3  # 1/m², mass per moment of inertia about the vertical axis
LOCK, STEERING_LAG, STEERING_RATE = 4, 5, 6  # rad, s, rad/s, of the front wheels
BRAKE_LAG, DRIVE_LAG = 7, 8  # s
BRAKE_FRONT, DRIVE_FRONT = 9, 10  # the front axle's share; NaN: that of its load
# Its tyres, by the names of the magic formula's coefficients.
C_X, MU_X, E_X, K_X = 11, 12, 13, 14
C_Y, MU_Y, E_Y, K_FRONT, K_REAR = 15, 16, 17, 18, 19
B_XA, B_XA2, C_XA, E_XA = 20, 21, 22, 23
B_YK, B_YK2, C_YK, E_YK = 24, 25, 26, 27
# B·κ by the share of the largest longitudinal force: at √(1 − share) = 0, 1/SLIPS, 2/SLIPS … 1.
SLIP, SLIPS = 28, 128
CHASSIS = SLIP + SLIPS + 1

# State.chassis: how it moves.
VX, VY, YAW_RATE = 0, 1, 2  # m/s, m/s, rad/s, of the centre of gravity, in the body's frame
STEER, FORCE = 3, 4  # rad, of the front wheels; m/s², of brakes and drive
X, Y, H, SPEED = 5, 6, 7, 8  # m, m, rad, m/s, of the rear axle's centre: where it has come to
MOTION = 9
