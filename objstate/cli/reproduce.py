"""``objstate reproduce``: the papers' experiments, one command each."""

from __future__ import annotations

import typer

from objstate.cli.options import help_when_alone
from objstate.cli.reproduce_schulz2001 import EXAMPLES, schulz2001

app = typer.Typer(
    help="Repeat the papers' experiments.", invoke_without_command=True, callback=help_when_alone
)
app.command(epilog=EXAMPLES)(schulz2001)
