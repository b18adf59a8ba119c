"""The whole model under one name: ``from bridgegen.openx.openscenario import model as osc``.

Elements bear the standard's names; their fields are its attributes and children in snake_case.
To support another element, declare it beside its like and add it to the choice that may hold it:
reading, writing, checking and their messages follow (see ``element``).

Source: ASAM OpenSCENARIO XML 1.0 to 1.3. An attribute or child is required here if every version
requires it; where versions differ in meaning, the newest counts.
"""

from bridgegen.openx.openscenario.actions import *  # noqa: F403  # noqa: F403
from bridgegen.openx.openscenario.conditions import *  # noqa: F403  # noqa: F403  # noqa: F403
from bridgegen.openx.openscenario.declarations import *  # noqa: F403  # noqa: F403
from bridgegen.openx.openscenario.entities import *  # noqa: F403  # noqa: F403
from bridgegen.openx.openscenario.enumerations import *  # noqa: F403
from bridgegen.openx.openscenario.environment import *  # noqa: F403
from bridgegen.openx.openscenario.global_actions import *  # noqa: F403
from bridgegen.openx.openscenario.movement import *  # noqa: F403  # noqa: F403
from bridgegen.openx.openscenario.positions import *  # noqa: F403  # noqa: F403
from bridgegen.openx.openscenario.storyboard import *  # noqa: F403  # noqa: F403
from bridgegen.openx.openscenario.traffic import *  # noqa: F403
from bridgegen.openx.openscenario.values import *  # noqa: F403
