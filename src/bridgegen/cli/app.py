"""The application that the commands are registered with, and how it is run."""

import errno
import os
import signal
import sys
from contextlib import suppress
from importlib.metadata import version
from typing import Annotated

import typer

from bridgegen.base.errors import BridgeGenError, Interrupted
from bridgegen.base.processes.child import collect_rarely
from bridgegen.cli.groups import Application, PanelledGroup, WithDefault

FAILED = 3
"""The exit status if a criterion of ``--fail-if`` holds; 1 is Python's for a bug, 2 a user's error,
130 Ctrl-C."""

app = Application(
    cls=PanelledGroup,
    name="bridgegen",
    help="Search an operational design domain for scenarios in which a driving stack fails.",
    invoke_without_command=True,
    pretty_exceptions_enable=False,
    # Rich's markup takes 0.1 s to import; `PanelledGroup` prints the panels as plain text.
    rich_markup_mode=None,
)
listing = Application(
    help="List scenarios, algorithms, drivers, places of a map …",
    no_args_is_help=True,
    rich_markup_mode=None,
)
app.add_typer(listing, name="list")

suites = Application(
    cls=WithDefault,
    help="Run many scenario files with all their variations.",
    rich_markup_mode=None,
)
app.add_typer(suites, name="suite")

benchmarks = Application(
    help="Compare planners, or search algorithms.",
    no_args_is_help=True,
    rich_markup_mode=None,
)
app.add_typer(benchmarks, name="benchmark")

analyses = Application(
    help="Analyse a run, or a recording.", no_args_is_help=True, rich_markup_mode=None
)
app.add_typer(analyses, name="analyse")

ontology = Application(
    help="Scenarios and maps as individuals of the ontology.",
    no_args_is_help=True,
    rich_markup_mode=None,
)
app.add_typer(ontology, name="ontology")


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"bridgegen {version('bridgegen')}")
        raise typer.Exit


@app.callback()
def without_command(
    context: typer.Context,
    show_version: Annotated[
        bool,
        typer.Option(
            "--version",
            help="Print the version and exit.",
            callback=_print_version,
            is_eager=True,
        ),
    ] = False,
) -> None:
    """Print the help if no command is given."""
    if context.invoked_subcommand is None:
        print(context.get_help())


INTERRUPTED, TERMINATED = 130, 143
"""The exit statuses after Ctrl-C and after SIGTERM: 128 and the number of the signal."""

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)


def main() -> None:
    """Run the command line; a user's error is one message on stderr and exit status 2.

    SIGTERM ends it as Ctrl-C does, what is computed kept, with another exit status.
    """
    collect_rarely()
    terminations: list[int] = []

    def terminate(number: int, frame: object) -> None:
        terminations.append(number)
        # SIGTERM ends a search as Ctrl-C does: the batch is recorded, and worker processes are
        # ended.
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, terminate)
    try:
        _run()
    except SystemExit as end:
        # What was complete when the signal came has its own status, 0.
        if terminations and end.code:
            raise SystemExit(TERMINATED) from None
        raise
    finally:
        signal.signal(signal.SIGTERM, before)


def _run() -> None:
    try:
        try:
            app()
        except SystemExit:
            sys.stdout.flush()  # else Python prints its own message at exit
            raise
    except Interrupted as stop:
        print(f"bridgegen: {stop}", file=sys.stderr)
        sys.exit(INTERRUPTED)
    except BridgeGenError as error:
        for problem in error.problems:
            print(f"bridgegen: error: {problem}", file=sys.stderr)
        sys.exit(2)
    except BrokenPipeError:
        _drop_output()
        sys.exit(1)
    except OSError as error:
        # Writing to stdout fails without a file's name; any other such error is a bug.
        if error.filename is not None or error.errno not in _FULL:
            raise
        _drop_output()
        print(f"bridgegen: error: the output cannot be written: {error.strerror}", file=sys.stderr)
        sys.exit(2)


def _drop_output() -> None:
    """Discard the remaining output, since its target cannot be written."""
    with suppress(OSError, ValueError):
        # Python flushes stdout at exit, and would fail again.
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
