"""What a run was made with: all that it takes to make it again, as JSON in its store."""

import json
import shlex
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from bridgegen.ego import STORYBOARD
from bridgegen.errors import StorageError
from bridgegen.simulation.choice import EMBEDDED

MAX_BUDGET = 10**7
MAX_SEED = 2**32 - 1
MAX_KEEP = 1000

Text = Annotated[str, Field(pattern="^[^\\x00]*$", max_length=4096)]
"""Of a run's settings; the system takes no path with NUL."""

Value = bool | int | float | Text
Part = Value | None | list[Value] | Mapping[Text, Value]


class _Chosen(BaseModel):
    """What ``Settings.chosen`` holds; runs of the first versions do not have it all."""

    model_config = ConfigDict(strict=True, allow_inf_nan=False)

    objective: Mapping[Text, float | None] | None
    weights: Text | None = None
    scale: Text | None = None
    objectives: Text | None = None
    count: Text | None = None
    metrics: list[Text] = []


SINCE: Mapping[str, Any] = {
    "distribution": None,
    "ideal": [],
    "causes": False,
    "cause": None,
    "adversary": None,
    "others": "scripted",
    "simulator": "embedded",
    "simulator_settings": {},
}
"""What a run of an earlier version, which could not say it, was made with."""


@dataclass(frozen=True)
class Settings:
    """The settings of a run.

    Attributes:
        scenario: a name of the catalogue, or the absolute path of a file.
        distribution: the absolute path of the file that says how its parameters are distributed.
        fingerprint: digest of what they said when the run began.
        algorithm: the search algorithm.
        algorithm_settings: every setting of it.
        budget: evaluations.
        seed: of the whole run.
        ego: the ego's driver.
        ideal: its stages that are ideal.
        time_limit: [s] that one call of a user's own driver may take, or None.
        axes: what is searched.
        fixed: parameters held at a value.
        map: the absolute path of an OpenDRIVE map, or None for the generated crossroads.
        map_digest: SHA-256 of that file.
        junction: the junction of the map that was chosen.
        keep: how many scenarios are handed over.
        causes: whether the causes of critical scenarios are sought.
        cause: the only one that counts, or None.
        adversary: the participant that an adversary drives, or None.
        others: who drives the other participants, where it is not what the scenario says.
        simulator: which one runs the scenarios.
        simulator_settings: what was chosen of how it does.
        objective: the objective with its weights, as ``Objective.to_dict`` gives it.
        chosen: what the user chose of the objective instead of the scenario's: metrics with
            weights, way of weighting, scale, one or many, whose conflicts count; None each where
            nothing; and the metrics
            to be recorded besides.
    """

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(
        strict=True, allow_inf_nan=False, revalidate_instances="always"
    )

    scenario: Text
    distribution: Text | None
    fingerprint: Text
    algorithm: Text
    algorithm_settings: Mapping[Text, Value]
    budget: Annotated[int, Field(ge=1, le=MAX_BUDGET)]
    seed: Annotated[int, Field(ge=0, le=MAX_SEED)]
    ego: Text
    ideal: tuple[Text, ...]
    time_limit: Annotated[float, Field(gt=0.0)] | None
    axes: tuple[Text, ...]
    fixed: Mapping[Text, float]
    map: Text | None
    map_digest: Text | None
    junction: Text | None
    keep: Annotated[int, Field(ge=0, le=MAX_KEEP)]
    causes: bool
    cause: Text | None
    adversary: Text | None
    others: Text | None
    simulator: Text
    simulator_settings: Mapping[Text, Value]
    objective: Mapping[Text, Any]
    chosen: Mapping[Text, Any]

    def to_dict(self) -> dict[str, Any]:
        """Return everything as JSON's types."""
        return {k: list(v) if isinstance(v, tuple) else v for k, v in asdict(self).items()}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], place: Path) -> Self:
        """Return the settings of a store.

        Raises:
            StorageError: a key is unknown or missing: the run is another version's; or a value is
                of the wrong type or out of its range.
        """
        data = {**SINCE, **data}
        if odd := set(data) ^ {one.name for one in fields(cls)}:
            raise StorageError(
                f"{place}: a run's settings must be those of this version; unknown or missing: "
                f"{', '.join(sorted(odd))}"
            )
        try:
            axes, ideal = (_TEXTS.validate_python(data[name]) for name in ("axes", "ideal"))
            data |= {"axes": tuple(axes), "ideal": tuple(ideal)}
            _Chosen.model_validate(data["chosen"])
            _OBJECTIVE.validate_python(data["objective"])
            settings = cls(**data)
            _SETTINGS.validate_python(settings)
        except ValidationError as error:
            first = error.errors(include_input=False, include_url=False)[0]
            where = ".".join(map(str, first["loc"]))
            what = f"{where}: {first['msg']}" if where else first["msg"]
            raise StorageError(f"{place}: the run's settings are damaged: {what}") from None
        return settings  # as recorded: an integer stays one

    def command(self, folder: Path) -> str:
        """Return the command line that makes the same run."""
        words = ["bridgegen", "search", self.scenario, "--algorithm", self.algorithm]
        words += ["--budget", str(self.budget), "--seed", str(self.seed)]
        if self.ego != STORYBOARD.name:
            words += ["--ego", self.ego]
        if self.ideal:
            words += ["--ideal", ",".join(self.ideal)]
        if self.time_limit is not None:
            words += ["--time-limit", repr(self.time_limit)]
        words += ["--axes", ",".join(self.axes), "--keep", str(self.keep)]
        if not self.causes:
            words.append("--no-causes")
        if self.cause:
            words += ["--cause", self.cause]
        if self.adversary:
            words += ["--adversary", self.adversary]
        if self.others:
            words += ["--others", self.others]
        if self.simulator != EMBEDDED.name:
            words += ["--simulator", self.simulator]
        for name, value in self.simulator_settings.items():
            words += ["--simulator-set", f"{name}={json.dumps(value)}"]
        if self.distribution:
            words += ["--distribution", self.distribution]
        for name, value in self.algorithm_settings.items():
            words += ["--set", f"{name}={json.dumps(value)}"]
        for name, value in self.fixed.items():
            words += ["--fix", f"{name}={value!r}"]
        if self.chosen["objective"]:
            terms = self.chosen["objective"].items()
            words += ["--objective", ",".join(m if w is None else f"{m}={w!r}" for m, w in terms)]
        for option in ("weights", "scale", "objectives", "count"):
            if self.chosen.get(option):  # runs of the first versions do not have them all
                words += [f"--{option}", self.chosen[option]]
        if also := self.chosen.get("metrics"):  # not in runs of the first versions
            words += ["--metrics", ",".join(also)]
        if self.map:
            words += ["--map", self.map, "--junction", str(self.junction)]
        return shlex.join([*words, "--out", str(folder)])


_SETTINGS = TypeAdapter(Settings)
_STRICT = ConfigDict(strict=True, allow_inf_nan=False)
_TEXTS = TypeAdapter(list[Text], config=_STRICT)
_OBJECTIVE = TypeAdapter(Mapping[Text, Part], config=_STRICT)
