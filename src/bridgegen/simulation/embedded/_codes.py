"""The numbers that the compiler writes into a program's tables and the kernels read there.

Without numba, so that compiling a storyboard does not wait for it; private like the kernels, so
that the cache of compiled code knows when one of them changes.
"""

# Program.elements: one row per element of the storyboard, each before its children.
KIND, PARENT, END, START, STOP, PRIORITY, COUNT, FIRST, LAST, EVENT_NUMBER = range(10)
STORY, ACT, GROUP, MANEUVER, EVENT, ACTION = range(6)
OVERRIDE, SKIP, PARALLEL = range(3)

# State.phase: OFF until the element's parent runs, then the standard's three states.
OFF, STANDBY, RUNNING, COMPLETE = range(4)
# State.stamps: the columns.
STARTED, ENDED, STOPPED, SKIPPED = range(4)

# Program.actions, columns that the storyboard reads; the others are their kinds' own.
WHOM, SELECTS = 0, 7

# Program.conditions: first and past-the-last probe, how they count, edge, delay in steps.
PROBES, PROBES_END, QUANTITY, EDGE, DELAY = range(5)
ANY, ALL, NOBODY = range(3)
NO_EDGE, RISING, FALLING, EITHER = range(4)

# Program.probes: what is looked at; see _probe_kernels.
PROBE, WHO, OTHER, RULE, LIMIT, PLACE = range(6)
NEVER_TRUE, SIMULATION_TIME, ELEMENT_STATE = range(3)
FIRST_BY_ENTITY = 10
SPEED, TRAVELED_DISTANCE, STAND_STILL, REACH_POSITION = range(10, 14)
RELATIVE_DISTANCE, TIME_TO_COLLISION, TIME_HEADWAY = range(14, 17)
GREATER, LESS, EQUAL, GREATER_EQUAL, LESS_EQUAL, NOT_EQUAL = range(6)
