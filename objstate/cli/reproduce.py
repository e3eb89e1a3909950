"""``objstate reproduce``: the papers' experiments, one command each."""

from __future__ import annotations

import typer

from objstate.cli import reproduce_schulz2001 as schulz
from objstate.cli.options import help_when_alone
from objstate.cli.reproduce_darmstadt import darmstadt
from objstate.cli.reproduce_elfring2012 import elfring2012
from objstate.cli.reproduce_elfring2014 import elfring2014
from objstate.cli.reproduce_maintenance import maintenance

app = typer.Typer(
    help="Repeat the papers' experiments.", invoke_without_command=True, callback=help_when_alone
)
app.command(epilog=schulz.EXAMPLES)(schulz.schulz2001)
app.command()(darmstadt)
app.command()(elfring2012)
app.command()(elfring2014)
app.command()(maintenance)
