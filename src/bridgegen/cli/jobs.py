"""The commands that are made of jobs; see `bridgegen.jobs.frame`."""

import inspect
import json
import sys
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer

from bridgegen.base.errors import BridgeGenError, Interrupted
from bridgegen.cli import options as common
from bridgegen.cli.app import FAILED, app, benchmarks, suites
from bridgegen.cli.connection import (
    NO_CONNECTION,
    Connection,
    with_connection_options,
    with_device,
    with_map_folder,
)
from bridgegen.cli.declared import declare, with_declared_options
from bridgegen.cli.groups import DEFAULT, DefaultCommand
from bridgegen.cli.run_files import FiledRun, Key, keys_of, schema, with_run_files
from bridgegen.engine.options import options_of
from bridgegen.engine.options.option import OUTPUT, WHAT
from bridgegen.jobs.benchmark.options import JOB as BENCHMARK
from bridgegen.jobs.compare.options import JOB as COMPARE
from bridgegen.jobs.credibility.options import JOB as CREDIBILITY
from bridgegen.jobs.dashboard.options import JOB as DASHBOARD
from bridgegen.jobs.frame import Job, JobResult
from bridgegen.jobs.mine.options import JOB as MINE
from bridgegen.jobs.preventability.options import JOB as PREVENTABILITY
from bridgegen.jobs.repair.options import JOB as REPAIR
from bridgegen.jobs.risk.options import JOB as RISK
from bridgegen.jobs.safety_case.options import JOB as SAFETY_CASE
from bridgegen.jobs.suite.options import DIFF, SUITE

JOBS = (
    COMPARE,
    SUITE,
    DIFF,
    REPAIR,
    BENCHMARK,
    PREVENTABILITY,
    RISK,
    DASHBOARD,
    SAFETY_CASE,
    CREDIBILITY,
    MINE,
)
"""Jobs in the order of ``--help``."""

_CRITERIA = {
    SUITE.name: "of_suite:SuiteCriteria",
    DIFF.name: "of_difference:DifferenceCriteria",
    SAFETY_CASE.name: "of_job:JobVerdict",
    CREDIBILITY.name: "of_job:JobVerdict",
}
"""Classes of criteria in `bridgegen.cli.verdict` by job; ``JobCriteria`` for all others."""

_OF_SIMULATOR = ("simulator", "simulator_set", "connection")


def command_of(job: Job) -> Any:
    """Return the function of a job's command, with the options that it declares."""
    kind: Any = job.options
    simulators = [option for option in options_of(kind) if option.name == "simulator"]

    def command(
        options: kind,
        simulator: str | None = None,
        simulator_set: common.SimulatorSettings = None,
        connection: Connection = NO_CONNECTION,
        fail_if: Annotated[
            list[str] | None,
            typer.Option(
                help=f"End with exit status 3 if this holds, e.g. '{job.example}'; may be "
                "repeated.",
                show_default=job.fails or False,
                rich_help_panel=OUTPUT,
            ),
        ] = None,
        junit: common.Junit = None,
        as_json: common.Json = False,
        save: common.Save = None,
    ) -> None:
        from bridgegen.cli.terminal.live import JobProgress
        from bridgegen.cli.terminal.tables import print_outcomes

        assert save is None  # written by the run file's reader, which knows what was given
        known = [*job.figures, *options.more_figures]
        judges = _criteria_of(job).read(fail_if or (), junit, known)
        if simulators:
            chosen = common.read_simulator(simulator, simulator_set, connection)
            options = replace(options, simulator=chosen) if chosen else options
        with JobProgress() as live:
            # Criteria are read before, so that a mistake in them costs no run.
            result = job.run(replace(options, callbacks=live.callbacks))
        _print(result, live.seconds, as_json=as_json)
        if not print_outcomes(judges.judge(result)):
            raise typer.Exit(FAILED)

    signature = inspect.signature(command)
    named = {parameter.name: parameter for parameter in signature.parameters.values()}
    for name in _OF_SIMULATOR if not simulators else ():
        del named[name]
    if not argument_of(job):
        del named["save"]
    if simulators:
        named["simulator"] = named["simulator"].replace(
            annotation=Annotated[str | None, declare(simulators[0])]
        )
    command.__signature__ = signature.replace(  # type: ignore[attr-defined]
        parameters=[*named.values()]
    )
    command.__name__, command.__doc__ = job.name.replace(" ", "_"), inspect.cleandoc(job.help)
    made = with_declared_options(command)
    return with_connection_options(made) if simulators else made


def _criteria_of(job: Job) -> Any:
    """Return the class of the criteria for a job's results."""
    # By name: the command line starts without the criteria's modules.
    module, _, name = _CRITERIA.get(job.name, "of_job:JobCriteria").partition(":")
    return getattr(import_module(f"bridgegen.cli.verdict.{module}"), name)


def schema_of(job: Job) -> dict[str, Any]:
    """Return the JSON Schema of the run files of a job."""
    return schema(keys_of(command_of(job), job.options), argument_of(job))


def _print(result: JobResult, seconds: float, *, as_json: bool) -> None:
    from bridgegen.cli.terminal.tables import print_table

    if as_json:
        print(json.dumps(result.to_json(), indent=1))
        return
    for name in result.shown():
        if isinstance(name, str):
            print(name)
        else:
            print_table(name.head, name.rows, as_json=False, texts=name.texts)
    print(f"{'wall time':<12}{seconds:.1f} s, {result.work}")


def run_all(
    path: Path, runs: list[FiledRun], keys: Mapping[str, Key], command: Any, job: Job
) -> None:
    """Do the jobs of a run file one after the other, each in a folder of its own if it has one.

    One that fails does not keep the others from running; the exit status is then 2.
    """
    status = 0
    for run in runs:
        print(f"\n{run.name}", flush=True)
        try:
            folder = Path(job.last_word) / path.stem / run.name
            command({**({"out": folder} if job.has_folder else {}), **run.values})
        except typer.Exit as ended:
            status = max(status, ended.exit_code)
        # Ctrl-C ends all of them, not only this one.
        except Interrupted:
            raise
        except BridgeGenError as error:
            for problem in error.problems:
                print(f"bridgegen: error: {run.name}: {problem}", file=sys.stderr)
            status = 2
    if status:
        raise typer.Exit(status)


def argument_of(job: Job) -> str:
    """Return the name of what a job's command takes without a spelling; "" if there is none."""
    return next((option.name for option in options_of(job.options) if option.is_argument), "")


def _add(job: Job) -> None:
    command = command_of(job)
    if argument := argument_of(job):
        several = partial(run_all, job=job)
        command = with_run_files(several, job.options, argument)(command)
    command = with_map_folder(WHAT)(command)
    if job in (SUITE, PREVENTABILITY, RISK):
        command = with_device(command)
    if job is SUITE:
        suites.command(DEFAULT, cls=DefaultCommand)(command)
    elif job.name.startswith("benchmark "):
        benchmarks.command(job.last_word)(command)
    else:
        app.command(job.name)(command)


for _job in JOBS:
    _add(_job)
