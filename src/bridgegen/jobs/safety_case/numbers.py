"""The numbers of a safety case: each with its definition, its source, and how it is written."""

from decimal import ROUND_CEILING, ROUND_FLOOR, ROUND_HALF_EVEN, Context, Decimal

from bridgegen.jobs.safety_case.model import PLACE, Form, Number, Statement

_ROUNDING = {
    "percent": ROUND_HALF_EVEN,
    "percent_up": ROUND_CEILING,
    "percent_down": ROUND_FLOOR,
}

RUN, TRIAGE = "run.sqlite", "triage.json"


def written(value: float | str, form: Form) -> str:
    """Return a number as a case writes it: bounds of shares are rounded outwards."""
    if isinstance(value, str):
        return value
    if form == "count":
        return f"{value:,.0f}"
    if form == "number":
        return f"{value:.3g}"
    share = Context(prec=3, rounding=_ROUNDING[form]).create_decimal(Decimal(value) * 100)
    return f"{share.normalize():f} %"


class Numbers:
    """The numbers of one run, in the order in which they are added.

    Args:
        run: id of the run, the first part of their ids.
    """

    def __init__(self, run: str) -> None:
        self._run = run
        self._held: dict[str, Number] = {}

    def __contains__(self, name: str) -> bool:
        return self.id(name) in self._held

    def __getitem__(self, name: str) -> Number:
        return self._held[self.id(name)]

    @property
    def all(self) -> tuple[Number, ...]:
        """Every number."""
        return tuple(self._held.values())

    def id(self, name: str) -> str:
        """Return the id of a number of this run."""
        return f"{self._run}.{name}"

    def add(
        self,
        name: str,
        value: float | str,
        form: Form = "count",
        *,
        of: str = "",
        source: str = RUN,
        unit: str = "1",
        again: str = "",
    ) -> None:
        """Add a number.

        Args:
            name: of it within the run: its definition, and which of several, see `Number`.
            value: of it.
            form: how it is written.
            of: see `Number`.
            source: the file that it is recomputed from.
            unit: of it.
            again: the command that determines it anew, where no file has what it follows from.
        """
        self._held[self.id(name)] = Number(
            id=self.id(name),
            value=value,
            unit=unit,
            form=form,
            text=written(value, form),
            of=of,
            source="" if again else source,
            again=again,
        )


def statement(template: str, numbers: dict[str, Number]) -> Statement:
    """Return a sentence in which ids in braces stand for numbers.

    Args:
        template: other braces stay.
        numbers: all of the case, by id.
    """
    text = PLACE.sub(
        lambda found: numbers[found[1]].text if found[1] in numbers else found[0], template
    )
    return Statement(text=text, template=template if text != template else "")
