"""The commands and what stands above them: ``objstate --version``, ``objstate --help``."""

from __future__ import annotations

from typing import Annotated

import typer

from objstate.cli import (
    batch,
    building,
    calibrate,
    compile,  # noqa: A004 - the module of a command
    convert,
    estimate,
    evaluate,
    inspect,
    next,  # noqa: A004 - the module of a command
    report,
    reproduce,
    serve,
    simulate,
    statistics,
    world,
)
from objstate.cli.console import print_text
from objstate.cli.local_paths import refuse_urls
from objstate.cli.options import help_when_alone

HELP = """Estimate which doors are open, how far, and where furniture stands, with probabilities.

objstate takes a robot's recorded log and a model of the building in which doors and furniture
are movable joints, and estimates the state of every object at every moment.
"""

EXAMPLES = """\b
First steps:
  objstate inspect drive.mcap
  objstate inspect office.urdf
  objstate estimate drive.mcap --building office.urdf --out out/drive
"""

app = typer.Typer(
    help=HELP,
    epilog=EXAMPLES,
    invoke_without_command=True,
    rich_markup_mode=None,  # plain help: quick, and the same in a pipe
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        print_text(f"objstate {version('objstate')}")
        raise typer.Exit


@app.callback()
def _start(
    context: typer.Context,
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version."
        ),
    ] = False,
) -> None:
    help_when_alone(context)


app.command(epilog=estimate.EXAMPLES)(estimate.estimate)
app.command(epilog=batch.EXAMPLES)(batch.batch)
app.command(epilog=inspect.EXAMPLES)(inspect.inspect)
app.command(epilog=evaluate.EXAMPLES)(evaluate.evaluate)
app.command(epilog=report.EXAMPLES)(report.report)
app.command(epilog=statistics.EXAMPLES)(statistics.statistics)
app.command(epilog=simulate.EXAMPLES)(simulate.simulate)
app.command(epilog=calibrate.EXAMPLES)(calibrate.calibrate)
app.command(epilog=convert.EXAMPLES)(convert.convert)
app.command("compile", epilog=compile.EXAMPLES)(compile.compile_)
app.add_typer(building.app, name="building")
app.command("next", epilog=next.EXAMPLES)(next.next_)
app.add_typer(world.app, name="world")
app.add_typer(serve.app, name="serve")
app.add_typer(reproduce.app, name="reproduce")
refuse_urls(app)
