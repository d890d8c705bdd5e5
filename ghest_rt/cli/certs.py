"""`ghest-rt certs`: the clinic's authority, and the identities of stations, therapy software and operators."""

import json
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table

from ghest_rt.cli.console import printing
from ghest_rt.cli.options import Json
from ghest_rt.cli.plain import PlainTyper
from ghest_rt.extras import need_extra
from ghest_rt.security.roles import Role, parse_common_name

if TYPE_CHECKING:
    from ghest_rt.security.authority import Authority, Issued

app = PlainTyper(
    no_args_is_help=True,
    help=(
        "Certificates for stations that are reached over a network: the clinic's authority and its identities "
        "(docs/security.md; needs the extra 'security')."
    ),
)

_DEFAULT_DAYS = 365
_AUTHORITY_DAYS = 3650

_Pki = Annotated[Path, typer.Option("--pki", metavar="FOLDER", help="The authority; keep it off the stations")]
_Name = Annotated[
    str, typer.Argument(metavar="ROLE.NAME", help="As `list` shows it, for example therapy.game-1", show_default=False)
]
_Days = Annotated[int, typer.Option("--days", metavar="DAYS", help="How long it holds")]
_Hosts = Annotated[
    list[str] | None,
    typer.Option(
        "--host", metavar="HOST", help="Name or address that others connect to it by; may be repeated", show_default=False
    ),
]
_DEFAULT_PKI = Path("ghest-pki")
_USED_BY = {Role.STATION: "[publisher] identity", Role.ROUTER: "ghest-rt gateway --identity"}


def _needs_security() -> None:
    """Checked by the commands themselves when they run: their help needs nothing."""
    need_extra("security", "an authority")


@app.command()
def init(
    clinic: Annotated[str, typer.Option(metavar="NAME", help="Stands in every certificate", show_default=False)],
    pki: _Pki = _DEFAULT_PKI,
    days: _Days = _AUTHORITY_DAYS,
) -> None:
    """Make the clinic's authority."""
    _needs_security()
    from ghest_rt.security.authority import Authority  # noqa: PLC0415  (needs the extra `security`)

    authority = Authority.create(pki, clinic, days)
    typer.echo(
        f"authority of {authority.clinic} in {pki}, valid until {authority.expires:%Y-%m-%d}\n"
        f"{pki}/ca-key.pem signs whatever it is told to: keep this folder off the stations, with a copy in a safe place",
    )


@app.command()
def issue(
    role: Annotated[Role, typer.Option(help="What the holder may do", show_default=False)],
    name: Annotated[
        str, typer.Argument(metavar="NAME", help="Of the machine or function, not of a person", show_default=False)
    ],
    hosts: _Hosts = None,
    pki: _Pki = _DEFAULT_PKI,
    days: _Days = _DEFAULT_DAYS,
) -> None:
    """Make an identity: a folder to be carried to its machine."""
    authority = _open(pki)
    folder = authority.issue(role, name, hosts or [], days)
    _tell(authority, f"{role}.{name}", folder)
    _tell_lists(authority.lists())


@app.command()
def renew(name: _Name, hosts: _Hosts = None, pki: _Pki = _DEFAULT_PKI, days: _Days = _DEFAULT_DAYS) -> None:
    """Make a new key and certificate for an identity; the old ones hold until they expire."""
    authority = _open(pki)
    _tell(authority, name, authority.renew(name, days, hosts or ()))


@app.command()
def revoke(name: _Name, pki: _Pki = _DEFAULT_PKI) -> None:
    """Take an identity off the access list for good."""
    authority = _open(pki)
    authority.revoke(name)
    typer.echo(f"{name} is revoked; no station lets it in once it has the new list")
    _tell_lists(authority.lists())


@app.command("list")
def list_identities(pki: _Pki = _DEFAULT_PKI, as_json: Json = False) -> None:
    """Show every certificate issued, with its state."""
    authority = _open(pki)
    now = datetime.now(UTC)
    if as_json:
        typer.echo(json.dumps(_document(authority, now), indent=2))
        return
    table = Table(title=f"{authority.clinic}, authority valid until {authority.expires:%Y-%m-%d}", title_justify="left")
    for column in ("identity", "state", "expires", "in days", "hosts"):
        table.add_column(column)
    for entry in authority.issued():
        left = (entry.expires - now).days
        table.add_row(entry.common_name, entry.state(now), f"{entry.expires:%Y-%m-%d}", str(left), ", ".join(entry.hosts))
    with printing():
        Console().print(table)


@app.command()
def check(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Of an identity", show_default=False)],
    connect: Annotated[
        str | None,
        typer.Option(
            metavar="ENDPOINT", help="Also shake hands with this station: tls/bed-1.clinic.lan:7446", show_default=False
        ),
    ] = None,
) -> None:
    """Say whether an identity can be used, and why a station refuses it."""
    _needs_security()
    from ghest_rt.security.handshake import try_handshake  # noqa: PLC0415  (needs the extra `security`)
    from ghest_rt.security.identity_check import load_identity  # noqa: PLC0415  (needs the extra `security`)

    identity = load_identity(folder)
    typer.echo(
        f"{identity.role}.{identity.name} can be used until {identity.expires:%Y-%m-%d %H:%M} UTC"
        + (f"; listens as {', '.join(identity.hosts)}" if identity.hosts else ""),
    )
    if connect is not None:
        try_handshake(connect, identity)
        typer.echo(f"{connect} accepts the certificate; what it may do there is decided by that station's access list")


def _open(pki: Path) -> "Authority":
    _needs_security()
    from ghest_rt.security.authority import Authority  # noqa: PLC0415  (needs the extra `security`)

    return Authority(pki)


def _tell(authority: "Authority", name: str, folder: Path) -> None:
    entry = next(entry for entry in reversed(authority.issued()) if entry.common_name == name)
    role, _ = parse_common_name(name)
    where = _USED_BY.get(role, "--identity of the program that connects")
    typer.echo(
        f"{name} until {entry.expires:%Y-%m-%d}: "
        f"carry {folder} to its machine ({where}) and delete it here: it holds the private key",
    )


def _tell_lists(lists: list[Path]) -> None:
    if lists:
        typer.echo(
            "stations and routers learn of it from their new access list (copy it, then restart the service or the gateway): "
            + ", ".join(map(str, lists)),
        )


def _document(authority: "Authority", now: datetime) -> dict[str, object]:
    def row(entry: "Issued") -> dict[str, object]:
        return {**entry.model_dump(mode="json"), "state": entry.state(now)}

    return {
        "clinic": authority.clinic,
        "authority_expires": authority.expires.isoformat(),
        "identities": [row(entry) for entry in authority.issued()],
    }
