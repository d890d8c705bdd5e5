"""Commands whose help speaks of what is to be given, not of the types that it becomes; `-h` is `--help` everywhere."""

from collections.abc import Callable
from typing import Any, TypeVar

import typer
from typer.core import TyperArgument, TyperCommand, TyperGroup

_Function = TypeVar("_Function", bound=Callable[..., Any])
_HELP = {"help_option_names": ["-h", "--help"]}


class _PlainCommand(TyperCommand):
    def get_params(self, ctx: Any) -> list[Any]:
        return [_plain(parameter, ctx) for parameter in super().get_params(ctx)]


class _PlainGroup(TyperGroup):
    def get_params(self, ctx: Any) -> list[Any]:
        return [_plain(parameter, ctx) for parameter in super().get_params(ctx)]


class PlainTyper(typer.Typer):
    """A Typer application with such commands."""

    def __init__(self, **settings: Any) -> None:
        """Take what Typer takes."""
        super().__init__(cls=_PlainGroup, context_settings=_HELP, **settings)

    def command(self, name: str | None = None, **settings: Any) -> Callable[[_Function], _Function]:
        """Do as Typer's decorator."""
        return super().command(name, cls=_PlainCommand, context_settings=_HELP, **settings)


def _plain(parameter: Any, ctx: Any) -> Any:
    """Return a parameter, its type told in plain words; older versions of Typer show no types of Python."""
    if not hasattr(parameter, "display_type_rich"):
        return parameter
    if isinstance(parameter, TyperArgument):
        parameter.display_type_rich = lambda ctx: None  # type: ignore[method-assign]  # its name says what it is
    elif parameter.metavar is None:
        told = parameter.display_type(ctx) or ""
        parameter.metavar = "" if told == "<bool>" else told.strip("<>").removeprefix("list[").removesuffix("]")
    return parameter
