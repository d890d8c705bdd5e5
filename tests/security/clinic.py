"""A clinic with every kind of identity, for tests: good ones, and ones that a station must refuse."""

import shutil
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

from ghest_rt.security.authority import Authority
from ghest_rt.security.identity import CA_FILE
from ghest_rt.security.roles import Role

HOSTS = ("localhost", "127.0.0.1")


@dataclass(frozen=True)
class Clinic:
    """Folders of identities.

    Attributes:
        station: Of this clinic, its access list newest.
        therapy: May subscribe and query.
        operator: May calibrate, too.
        router: Passes messages on.
        other_station: Of this clinic, for another host.
        revoked: Once a therapy identity.
        expired: A therapy identity, since yesterday.
        short_lived: A therapy identity; `let_expire` says when it ends.
        foreign: Signed by another clinic's authority.
        lookalike: Signed by an authority of our clinic's name, made by somebody else.
    """

    station: Path
    therapy: Path
    operator: Path
    router: Path
    other_station: Path
    revoked: Path
    expired: Path
    short_lived: Path
    foreign: Path
    lookalike: Path


def make_clinic(root: Path, name: str = "Clinic A") -> Clinic:
    """Make one in a new folder."""
    now = datetime.now(UTC)
    long_ago = now - timedelta(days=30)
    Authority.create(root / "pki", name, 3650, long_ago)
    past = Authority(root / "pki", long_ago)
    expired = past.issue(Role.THERAPY, "expired", (), 29)
    authority = Authority(root / "pki", now)
    station = authority.issue(Role.STATION, "bed-1", HOSTS, 365)
    other_station = authority.issue(Role.STATION, "bed-2", ("bed-2.clinic.example",), 365)
    therapy = authority.issue(Role.THERAPY, "game-1", (), 365)
    operator = authority.issue(Role.OPERATOR, "bench-1", (), 365)
    router = authority.issue(Role.ROUTER, "hall", HOSTS, 365)
    revoked = authority.issue(Role.THERAPY, "stolen", (), 365)
    authority.revoke("therapy.stolen")
    short_lived = authority.issue(Role.THERAPY, "short", (), 1)
    return Clinic(
        station=station,
        therapy=therapy,
        operator=operator,
        router=router,
        other_station=other_station,
        revoked=revoked,
        expired=expired,
        short_lived=short_lived,
        foreign=_outsider(root / "foreign", "Clinic B", station),
        lookalike=_outsider(root / "lookalike", name, station),
    )


def let_expire(clinic: Clinic, seconds: float) -> None:
    """Renew the short-lived identity so that it expires after so many seconds."""
    yesterday = datetime.now(UTC) - timedelta(days=1) + timedelta(seconds=seconds)
    Authority(clinic.short_lived.parents[1], yesterday).renew("therapy.short", 1)


def _outsider(folder: Path, name: str, station: Path) -> Path:
    """Make an identity of another authority that trusts our station."""
    identity = Authority.create(folder, name, 3650).issue(Role.THERAPY, "game-1", (), 365)
    shutil.copy(station / CA_FILE, identity / CA_FILE)
    return identity
