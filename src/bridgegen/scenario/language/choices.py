"""What a category may choose of a participant: its type or model, and where it starts and goes."""

from collections.abc import Sequence

from bridgegen.scenario.language.parameters import Axis, Parameter, nearest
from bridgegen.scenario.language.places import Quantities
from bridgegen.scenario.language.plain_yaml import Path
from bridgegen.scenario.language.story_schema import ParticipantSection
from bridgegen.scenario.named_models import MODELS, type_of
from bridgegen.scenario.participants import PARTICIPANTS, TYPES


class Choices:
    """Reads which categories choose what, and reports their problems.

    Args:
        quantities: of the file; collects problems.
    """

    def __init__(self, quantities: Quantities) -> None:
        self._quantities, self._report = quantities, quantities.report

    def types(self, given: ParticipantSection) -> tuple[str, ...]:
        """Return the types and models that a category gives; empty without one."""
        known = (*TYPES, *MODELS)
        return tuple(name for name in self._names(given.type_by) if name in known)

    def places(self, given: ParticipantSection) -> tuple[str, ...]:
        """Return the names of the places that a category gives, in its order; empty without one."""
        return tuple(name for name in self._names(given.place_by) if name in given.places)

    def check_types(self, name: str, given: ParticipantSection, path: Path) -> None:
        """Check the category that gives a participant's type, if there is one."""
        place = (*path, "type_by")
        parameter = self._category(given.type_by, "type", place)
        if parameter is None:
            return
        usual = PARTICIPANTS[given.type]
        for kind in parameter.kind.names:
            if kind not in TYPES and kind not in MODELS:
                hint = nearest(kind, (*TYPES, *MODELS))
                self._report(
                    f"the values of {given.type_by} must be types of participants or names of "
                    f"models, got '{kind}'{hint}",
                    place,
                )
                continue
            found = PARTICIPANTS[type_of(kind)]
            if (found.seen_as.conduct, found.on_rails) != (
                usual.seen_as.conduct,
                usual.on_rails,
            ):
                self._report(
                    f"the types of {name} must be moved by the same rules, a {kind} is not as a "
                    f"{given.type}",
                    place,
                )
        default, said = parameter.kind.names[int(parameter.default)], given.model or given.type
        if default != said:
            what = "model" if default in MODELS else "type"
            self._report(
                f"{what} of {name} must be the default of {given.type_by}, {default}, got {said}",
                place,
            )
        if given.body is not None:
            self._report(f"{name} has a body of its own, or types that vary, not both", place)

    def check_places(self, name: str, given: ParticipantSection, path: Path) -> None:
        """Check the category that gives a participant's place, if there is one."""
        if given.place_by is None:
            if given.places:
                self._report(
                    f"{name} has places, so it needs place_by, the category that chooses one",
                    (*path, "places"),
                )
            return
        parameter = self._category(given.place_by, "place", (*path, "place_by"))
        if given.start is not None or given.end is not None or given.path:
            self._report(f"{name} has places, so it has no start, end or path of its own", path)
        names: Sequence[str] = parameter.kind.names if parameter else ()
        if parameter is not None and {*names} != {*given.places}:
            self._report(
                f"places of {name} must be one for each value of {given.place_by}, "
                f"{', '.join(names)}, got {', '.join(given.places) or 'none'}",
                (*path, "places"),
            )

    def default_place(self, given: ParticipantSection) -> str | None:
        """Return the place that the category's default chooses; None without one."""
        parameter = self._quantities.parameters.get(given.place_by or "")
        if parameter is None or not parameter.kind.names:
            return next(iter(given.places), None)
        found = parameter.kind.names[int(parameter.default)]
        return found if found in given.places else next(iter(given.places), None)

    def _category(self, name: str | None, what: str, place: Path) -> Parameter | None:
        """Return a category by its name; None, and a problem, if there is none."""
        if name is None:
            return None
        self._quantities.used.add(name)
        found = self._quantities.parameters.get(name)
        if found is None or not found.kind.names:
            hint = nearest(name, self._quantities.parameters)
            self._report(f"{what}_by must name a category, got '{name}'{hint}", place)
            return None
        if found.axis is Axis.STATIC:
            self._report(f"the category of a {what} must not be of the static axis", place)
        return found

    def _names(self, name: str | None) -> Sequence[str]:
        found = self._quantities.parameters.get(name or "")
        return found.kind.names if found is not None else ()
