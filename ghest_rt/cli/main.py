"""Entry point of `ghest-rt`."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from ghest_rt.cli.certs import app as certs_app
from ghest_rt.cli.commands import installation, live, protection, recordings
from ghest_rt.cli.options import Json, ListenEndpoint, MethodOption, NoPublish, OtherStation, Verbose
from ghest_rt.cli.plain import PlainTyper
from ghest_rt.cli.study.app import app as study_app
from ghest_rt.errors import GhestError

app = PlainTyper(
    name="ghest-rt",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    help=(
        "Glenohumeral (shoulder) angles inside a rehabilitation exoskeleton, in real time, from two RGB-D cameras "
        "and the encoders.\n\n"
        "Try it without hardware: [bold]ghest-rt --replay sim_fixtures/[/] and, in a second terminal, [bold]ghest-rt listen[/]"
    ),
)

for _topic in (live, recordings, installation, protection):
    app.add_typer(_topic.app)
app.add_typer(certs_app, name="certs")
app.add_typer(study_app)


@app.callback(invoke_without_command=True)
def root(
    context: typer.Context,
    replay: Annotated[
        Path | None,
        typer.Option(
            "--replay",
            metavar="PATH",
            help="Run the service from a recording, or from every recording of a folder, one after the other",
            show_default=False,
        ),
    ] = None,
    speed: Annotated[
        str,
        typer.Option(
            metavar="FACTOR|max",
            help="Pace of the replay: 1 as recorded, 2.5 faster; 'max' publishes every sample as fast as the machine allows",
        ),
    ] = "1",
    loop: Annotated[bool, typer.Option("--loop", metavar="", help="Replay again and again until stopped")] = False,
    method: MethodOption = None,
    station: OtherStation = None,
    listen: ListenEndpoint = None,
    no_publish: NoPublish = False,
    as_json: Json = False,
    verbose: Verbose = False,
    version: Annotated[bool, typer.Option("--version", metavar="", help="Print the version")] = False,
) -> None:
    """Run from a recording with --replay, or use one of the commands."""
    from ghest_rt.cli.console import set_up_logging

    set_up_logging(verbose)
    if version:
        from ghest_rt import __version__

        typer.echo(__version__)
    elif context.invoked_subcommand is not None:
        if replay is not None:
            raise typer.BadParameter(f"--replay and the command {context.invoked_subcommand!r} exclude each other")
    elif replay is None:
        raise typer.BadParameter("name a recording with --replay, or a command (see ghest-rt --help)")
    else:
        from ghest_rt.cli.replay import ReplayOptions, replay_path

        replay_path(ReplayOptions(replay, speed, loop, method, station, listen, not no_publish, as_json))


def main() -> None:
    """Run the command line; errors that a user can mend become one message and an exit code."""
    try:
        app(_verbose_first(sys.argv[1:]))
    except GhestError as error:
        _fail(str(error), error.exit_code)
    except KeyboardInterrupt:
        _fail("interrupted", 130)
    except Exception as error:
        from ghest_drivers.errors import DriverError

        if not isinstance(error, DriverError):
            raise
        _fail(str(error), 3)


def _verbose_first(arguments: list[str]) -> list[str]:
    """Return the arguments with --verbose before the command, behind which it may stand as well."""
    end = arguments.index("--") if "--" in arguments else len(arguments)
    verbose = [word for word in arguments[:end] if word in ("--verbose", "-v")]
    return [*verbose[:1], *(word for word in arguments[:end] if word not in ("--verbose", "-v")), *arguments[end:]]


def _fail(message: str, exit_code: int) -> None:
    sys.stderr.write(f"ghest-rt: {message}\n")
    sys.exit(exit_code)


if __name__ == "__main__":
    main()
