"""The settings of a run: all that repeating it needs, as JSON in its store."""

import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Self, get_type_hints

from pydantic import ConfigDict, TypeAdapter, ValidationError

from bridgegen.base.errors import InputError, StorageError
from bridgegen.drivers import STORYBOARD, is_spec
from bridgegen.engine.options import SearchOptions, options_of, range_problems
from bridgegen.engine.options.option import ALWAYS
from bridgegen.jobs.search.scenarios import PAPER, is_file
from bridgegen.scenario.language.objectives import PAPERS
from bridgegen.simulation.choice import SimulatorChoice, Value

DEFAULTS_BEFORE_FIELD: Mapping[str, Any] = {
    option.name: option.before
    for option in options_of(SearchOptions)
    if option.before is not ALWAYS
}
"""The values that apply to a run recorded before an option existed."""

CHOSEN = ("objective", "weights", "scale", "objectives", "count", "metrics")
"""The options that are recorded together, under the key ``chosen``."""

OF_DRIVER = ("ego", "ideal")
OF_ROW = (
    "distribution", "empty_trigger", "odd", "road_map", "junction", "objective", "critical",
    "others", "vehicle",
)  # fmt: skip
"""The options on which the motion of a row depends, besides its values."""

RECORDED_AS: Mapping[str, str] = {
    "settings": "algorithm_settings",
    "road_map": "map",
    "optimised": "objective",
}
"""Keys in a record of the settings that differ from the names of their fields."""

MAX_TEXT = 4096
"""Largest number of characters of one text."""

Part = Value | None | list[Value] | Mapping[str, Value]


@dataclass(frozen=True, kw_only=True)
class Settings(SearchOptions):
    """The settings of a run: its options, all of them resolved, and digests of its files.

    Paths are absolute. The options that default to the scenario, the algorithm or the map are
    resolved: ``settings``, ``budget``, ``seed``, ``ego``, ``ideal``, ``axes``, ``junction`` and
    ``adversary``. The options of the objective are as given.

    Attributes:
        scenario: a name of the catalogue, or the path of a file.
        fingerprint: digest of the scenario and its distribution when the run began.
        driver_digest: see `bridgegen.drivers.identity.digest_of`; "" in earlier runs, too.
        map_digest: SHA-256 of the map's file, where there is one.
        optimised: the objective with its weights, as ``Objective.to_dict`` gives it.
        own_metrics: what is known of the metrics of the user's own, but their code.
    """

    budget: int
    seed: int
    ego: str
    scenario: str
    fingerprint: str
    map_digest: str | None
    optimised: Mapping[str, Any]
    own_metrics: Sequence[Mapping[str, str | float]] = ()
    driver_digest: str = ""
    odd: Mapping[str, Any] | None = None

    @property
    def called(self) -> str:
        """What the driver is called: as the user says, else its name."""
        return self.driver_name or self.ego

    def to_dict(self) -> dict[str, Any]:
        """Return everything as JSON's types."""
        plain = {field.name: _plain(getattr(self, field.name)) for field in fields(self)}
        if not self.own_metrics:
            del plain["own_metrics"]  # as in runs of earlier versions
        for name in ("odd", "repeats"):
            if plain[name] is None:
                del plain[name]
        if not self.rate:
            del plain["rate"], plain["exposure"]
        chosen = {name: plain.pop(name) for name in CHOSEN}
        plain["simulator_settings"] = dict(self.simulator.settings)
        plain["simulator"] = self.simulator.name
        if self.screen is not None:
            plain["screen"] = {"name": self.screen.name, "settings": dict(self.screen.settings)}
        recorded = {RECORDED_AS.get(name, name): value for name, value in plain.items()}
        return recorded | {"chosen": chosen}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], place: Path) -> Self:
        """Return the settings of a store.

        Raises:
            StorageError: a key is unknown or missing: the run is another version's; or a value is
                of the wrong type or out of its range.
        """
        try:
            given = _by_field(data)
            if odd := given.keys() ^ _ADAPTERS.keys():
                raise StorageError(
                    f"{place}: a run's settings must be those of this version; unknown or missing: "
                    f"{', '.join(sorted(RECORDED_AS.get(name, name) for name in odd))}"
                )
            for name, adapter in _ADAPTERS.items():
                adapter.validate_python(given[name])
            if any("\0" in text or len(text) > MAX_TEXT for text in _texts(data)):
                raise ValueError(f"a text holds NUL, or more than {MAX_TEXT} characters")
            name, settings = given.pop("simulator"), given.pop("simulator_settings")
            screen = given.pop("screen")
            batch = given["screen_batch"] is not None or given["rate"]
            if screen is not None and not (given["screen_budget"] is not None and batch):
                raise ValueError("screen: its budget and its batch must be recorded, too")
            found = cls(
                **given,
                simulator=SimulatorChoice(name, settings),
                screen=None if screen is None else SimulatorChoice(**screen),
            )
            if problems := range_problems(found):
                raise InputError(*problems)
        except ValidationError as error:
            first = error.errors(include_input=False, include_url=False)[0]
            inside = [str(number) for number in first["loc"] if number not in ("float", "str")]
            where = ".".join([RECORDED_AS.get(name, name), *inside])
            what = f"{where}: {first['msg']}"
            raise StorageError(f"{place}: the run's settings are damaged: {what}") from None
        except (InputError, TypeError, ValueError) as error:
            raise StorageError(f"{place}: the run's settings are damaged: {error}") from None
        if found.objective is None and found._has_papers_terms:
            return replace(found, objective={PAPER: None})
        return found  # as recorded: an integer stays one

    @property
    def _has_papers_terms(self) -> bool:
        """Whether a catalogue scenario had the paper's objective, once the default of four."""
        terms = [term.metric for term in PAPERS.terms]
        return not is_file(self.scenario) and self.optimised.get("names") == terms

    def command(self, folder: Path) -> str:
        """Return the command line that repeats the run."""
        words = ["bridgegen", "search", self.scenario]
        for option in options_of(type(self)):
            if option.name != "ego" or self.ego != STORYBOARD.name:
                words += option.words(getattr(self, option.name))
        return shlex.join([*words, "--out", str(folder)])

    def keep_command(self, folder: Path) -> str:
        """Return the command line that keeps the run's failures in a suite."""
        # What only a run's file names is not run: code must be named again.
        named = ["--ego", self.ego] if is_spec(self.ego) else []
        return f"{shlex.join(['bridgegen', 'suite', 'add', str(folder), *named])} --to SUITE"

    def simulated(self, driver: bool = True) -> str:
        """Return the command line that simulates a row of the run, without its values.

        Args:
            driver: whether it names the run's driver; else another one may follow.
        """
        words = ["bridgegen", "simulate", self.scenario]
        for option in options_of(type(self)):
            of_driver = option.name in OF_DRIVER
            if option.name in OF_ROW or (of_driver and driver and self.ego != STORYBOARD.name):
                words += option.words(getattr(self, option.name))
        return shlex.join(words)


def _plain(value: Any) -> Any:
    if isinstance(value, tuple):
        return list(value)
    return dict(value) if isinstance(value, Mapping) else value


def _by_field(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return recorded values by the names of fields, with those that an old run lacks.

    An unknown key stays, and is not mistaken for a field that is recorded under another key.

    Raises:
        ValueError: the value of ``chosen`` is not an object.
    """
    chosen = data.get("chosen")
    if not isinstance(chosen, dict):
        raise ValueError("chosen: must be an object")
    moved = {*RECORDED_AS, *CHOSEN}
    field_of = {key: name for name, key in RECORDED_AS.items()}
    given = {**DEFAULTS_BEFORE_FIELD, "driver_digest": "", "own_metrics": ()}
    given |= {"simulator": given["simulator"].name, "simulator_settings": {}}
    for key, value in data.items():
        if key != "chosen":
            given[field_of.get(key, f"'{key}'" if key in moved else key)] = value
    for key, value in chosen.items():
        given[key if key in CHOSEN else f"chosen.{key}"] = value
    return given


def _texts(value: Any) -> Iterator[str]:
    """Yield all texts in a JSON value."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping):
        for key, item in value.items():
            yield key
            yield from _texts(item)
    elif isinstance(value, list):
        for item in value:
            yield from _texts(item)


_STRICT = ConfigDict(strict=True, allow_inf_nan=False)
_ADAPTERS = {
    name: TypeAdapter(kind, config=_STRICT)
    for name, kind in {
        **{field.name: get_type_hints(Settings)[field.name] for field in fields(Settings)},
        "simulator": str,
        "simulator_settings": Mapping[str, Value],
        "screen": Mapping[str, str | Mapping[str, Value]] | None,
        "optimised": Mapping[str, Part],
    }.items()
}
