"""A run file of several runs: made one after the other, and resumed."""

import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import typer

from bridgegen.base.errors import BridgeGenError, Interrupted
from bridgegen.cli.run_files import FiledRun, Key, Values, is_recorded


def search_all(
    path: Path,
    runs: list[FiledRun],
    keys: Mapping[str, Key],
    command: Callable[[Values], object],
) -> None:
    """Run a file of several runs one after the other; resume those that were interrupted.

    Args:
        path: of the file.
        runs: of the file; each is recorded beside its folder, as ``FOLDER.yaml``.
        keys: of a run.
        command: searches with some options.
    """
    from bridgegen.cli.terminal.search import SearchScreen, conclusion, print_summary
    from bridgegen.jobs.search import Run, resume

    ends: dict[str, str] = {}
    status = 0
    for one in runs:
        out = Path(one.values.get("out") or Path("runs") / path.stem / one.name)
        values = {**one.values, "out": out}
        print(f"\n{one.name}", flush=True)
        try:
            if not is_recorded(out, values, keys):
                command(values)
            elif Run(out).finished and Run(out).report.is_file():
                print(f"finished already: {out}")
            else:
                with SearchScreen() as screen:
                    run = resume(
                        out,
                        ego=values.get("ego"),
                        worse_than=values.get("worse_than"),
                        algorithm=values.get("algorithm"),
                        callbacks=screen.callbacks,
                    )
                print_summary(run, screen.seconds)
        except Interrupted as stop:
            raise Interrupted(
                stop.folder, stop.evaluations, stop.budget, command=f"bridgegen search {path}"
            ) from None
        except typer.Exit as ended:
            status = max(status, ended.exit_code)
        except BridgeGenError as error:
            for problem in error.problems:
                print(f"bridgegen: error: {one.name}: {problem}", file=sys.stderr)
            status, ends[one.name] = 2, f"failed: {error.problems[0]}"
            continue
        ends[one.name] = f"{conclusion(Run(out))} ({out})"
    print()
    for name, end in ends.items():
        print(f"{name:<{max(map(len, ends)) + 2}}{end}")
    if status:
        raise typer.Exit(status)
