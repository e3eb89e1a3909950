"""``objstate serve`` and ``objstate serve token make | list | revoke``"""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from objstate.cli.console import print_notice, print_table, print_text
from objstate.cli.options import AsJson, Config, Mounts, Topics, help_when_alone
from objstate.cli.parsing import parse_mounts, split_topics
from objstate.errors import SettingsError

if TYPE_CHECKING:
    from objstate.service.live.options import Protocol, RobotAddress
    from objstate.service.tokens import Tokens

EXAMPLES = """\b
Examples:
  objstate serve --building office.urdf --world world.db
  objstate serve --building office.urdf --world world.db --token-file token --port 0
  objstate serve --building office.urdf --world postgresql://me@server/robots \\
      --host 0.0.0.0 --tls-cert cert.pem --tls-key key.pem
  curl -H "Authorization: Bearer $(cat token)" --data-binary @drive.mcap \\
      http://127.0.0.1:8000/v1/drives
  curl -H "Authorization: Bearer $(cat token)" \\
      "http://127.0.0.1:8000/v1/objects/door_07/passage?width=0.6&length=0.9"
"""
TOKEN_EXAMPLES = """\b
Examples:
  objstate serve token make planner --role read --world world.db
  objstate serve token list --world world.db
  objstate serve token revoke 1f0c22ab --world world.db
"""
GIGABYTE = 10**9
MISSING = "Serving needs Starlette and Uvicorn ({error}); pip install 'objstate[service]'."

World = Annotated[
    str, typer.Option(metavar="WORLD", help="A file, or postgresql://USER@HOST/DATABASE.")
]

app = typer.Typer(invoke_without_command=True)
tokens_app = typer.Typer(
    help="Who may ask the service what.", invoke_without_command=True, callback=help_when_alone
)
app.add_typer(tokens_app, name="token")


@app.callback(epilog=EXAMPLES)
def serve(
    context: typer.Context,
    building: Annotated[
        Path | None, typer.Option(metavar="URDF", help="The building that robots drive in.")
    ] = None,
    world: Annotated[
        str | None,
        typer.Option(
            metavar="WORLD", help="Where what is believed is kept; made where there is none."
        ),
    ] = None,
    host: Annotated[str, typer.Option(help="The address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="0 takes a free one.")] = 8000,
    token_file: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The first token is written there. Default: printed."),
    ] = None,
    data: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Logs and results. Default: WORLD.data, or here DATABASE.SCHEMA.data.",
        ),
    ] = None,
    new_data: Annotated[
        bool, typer.Option("--new-data", help="The folder of the world's drives is lost.")
    ] = False,
    tls_cert: Annotated[
        Path | None, typer.Option(metavar="PEM", help="Certificate, for other hosts than this.")
    ] = None,
    tls_key: Annotated[Path | None, typer.Option(metavar="PEM", help="Its key.")] = None,
    behind_proxy: Annotated[
        bool, typer.Option("--behind-proxy", help="A proxy in front of it does TLS.")
    ] = False,
    largest_log: Annotated[float, typer.Option(metavar="GB", help="Of one upload.", min=0.0)] = 4.0,
    time_limit: Annotated[
        float, typer.Option(metavar="S", help="For the estimation of one drive.", min=1.0)
    ] = 3600.0,
    memory_limit: Annotated[
        float, typer.Option(metavar="GB", help="Of the process that reads a log.", min=0.5)
    ] = 8.0,
    rate: Annotated[
        float, typer.Option(metavar="N", help="Requests a second of one token.", min=0.1)
    ] = 1000.0,
    scenes: Annotated[
        bool, typer.Option("--scenes", help="Record drives as scenes for Foxglove, too.")
    ] = False,
    foxglove: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=URL",
            help="A robot whose foxglove_bridge is connected to, as robot_1=ws://10.0.0.7:8765.",
        ),
    ] = None,
    rosbridge: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=URL", help="The same of a robot with rosbridge."),
    ] = None,
    watch: Annotated[
        list[str] | None,
        typer.Option(metavar="PLACE", help="A folder or URL where logs are dropped."),
    ] = None,
    foxglove_port: Annotated[
        int | None,
        typer.Option(metavar="PORT", help="Show live drives to Foxglove on this machine."),
    ] = None,
    is_global: Annotated[
        bool, typer.Option("--global", help="Robots may start anywhere in the building.")
    ] = False,
    workers: Annotated[
        int, typer.Option(metavar="N", help="Processes that answer.", min=1, max=64)
    ] = 1,
    mount: Mounts = None,
    topics: Topics = None,
    config: Config = None,
) -> None:
    """Serve a world: robots send drives, planners ask, people watch.

    Drives are estimated one after the other and teach the world; doors, passages, blocked paths and
    a stream of what changes are answered over HTTP (/openapi.json). Nothing that was acknowledged
    is lost, however the service ends. Only this machine can reach it unless you say otherwise.
    """
    if context.invoked_subcommand is not None:
        return
    if building is None or world is None:
        help_when_alone(context)
        raise typer.Exit(2)
    from objstate.config import load_settings
    from objstate.run import RunOptions

    try:
        from objstate.service.options import ServiceOptions, data_folder
        from objstate.service.running import run_service
    except ImportError as error:
        raise SettingsError(MISSING.format(error=error)) from error
    options = ServiceOptions(
        building=building,
        world=world,
        data=data or data_folder(world),
        new_data=new_data,
        host=host,
        port=port,
        token_file=token_file,
        tls_certificate=tls_cert,
        tls_key=tls_key,
        behind_proxy=behind_proxy,
        largest_log=round(largest_log * GIGABYTE),
        time_limit_s=time_limit,
        memory_limit=round(memory_limit * GIGABYTE),
        requests_per_s=rate,
        scenes=scenes,
        robots=(*_robots("foxglove", foxglove), *_robots("rosbridge", rosbridge)),
        watched=tuple(watch or ()),
        foxglove_port=foxglove_port,
        workers=workers,
        run=RunOptions(
            settings=load_settings(config),
            global_start=is_global,
            mounts=parse_mounts(mount or []),
            topics=split_topics(topics or []),
        ),
    )

    def ready(address: str, secret: str | None) -> None:
        print_notice(f"{address} (Ctrl-C ends it); logs and results in {options.data}")
        if secret is not None and token_file is not None:
            print_notice(f"The first token is in {token_file}.")
        elif secret is not None:
            print_notice(f"The first token, which isn't shown again: {secret}")
            print_notice(f"The page, opened with it: {address}#token={secret}")

    run_service(options, ready)


def _robots(protocol: Protocol, named: list[str] | None) -> Iterator[RobotAddress]:
    """Robots that are connected to. Raises SettingsError."""
    from objstate.service.live.options import RobotAddress

    for text in named or ():
        robot, _, address = text.partition("=")
        if not robot or not address.startswith(("ws://", "wss://")):
            raise SettingsError(
                f"--{protocol} {text} names no robot and its address; give robot_1=ws://HOST:PORT."
            )
        yield RobotAddress(robot, protocol, address)


@tokens_app.command("make", epilog=TOKEN_EXAMPLES)
def make(
    name: Annotated[str, typer.Argument(help="Whose it is.")],
    world: World,
    role: Annotated[
        str, typer.Option(help="read; teach, which may send drives; admin, which may delete.")
    ] = "read",
) -> None:
    """Make a token. It is printed once; only its hash is kept."""
    from objstate.service.tokens import Role

    try:
        chosen = Role(role)
    except ValueError as error:
        raise SettingsError(f"'{role}' is no role; give read, teach or admin.") from error
    _, secret = _tokens(world).make(name, chosen)
    print_text(secret)


@tokens_app.command("list", epilog=TOKEN_EXAMPLES)
def list_(world: World, as_json: AsJson = False) -> None:
    """All tokens, without their secrets."""
    tokens = _tokens(world).all()
    if as_json:
        import json

        from objstate.cli.json_values import json_values

        print_text(json.dumps(json_values(tokens), indent=2))
        return
    from rich.table import Table

    table = Table("id", "name", "role", "made", "revoked")
    for token in tokens:
        revoked = "" if token.revoked_ns is None else _day(token.revoked_ns)
        table.add_row(token.id, token.name, token.role.value, _day(token.made_ns), revoked)
    print_table(table)


@tokens_app.command("revoke", epilog=TOKEN_EXAMPLES)
def revoke(
    identity: Annotated[str, typer.Argument(metavar="ID", help="As `token list` shows it.")],
    world: World,
) -> None:
    """Let a token open nothing any more."""
    _tokens(world).revoke(identity)
    print_text(f"Revoked: {identity}")


def _tokens(world: str) -> Tokens:
    from objstate.service.tables import make_tables
    from objstate.service.tokens import Tokens
    from objstate.world.database import Database
    from objstate.world.location import parse_location
    from objstate.world.store import open_store

    open_store(world)
    database = Database(parse_location(world))
    make_tables(database)
    return Tokens(database)


def _day(stamp_ns: int) -> str:
    return datetime.fromtimestamp(stamp_ns / 1e9, UTC).strftime("%Y-%m-%d %H:%M")
