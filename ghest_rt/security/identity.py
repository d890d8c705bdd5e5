"""An identity: a folder with certificate, private key and the clinic's CA. `identity_check` reads and checks one."""

import logging
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

from ghest_rt.extras import need_extra
from ghest_rt.security.access import AccessList
from ghest_rt.security.roles import Role

_log = logging.getLogger(__name__)

CA_FILE = "ca.pem"
CERTIFICATE_FILE = "certificate.pem"
KEY_FILE = "key.pem"

EXPIRES_SOON = timedelta(days=30)


@dataclass(frozen=True, slots=True)
class Identity:
    """A checked identity.

    Attributes:
        folder: Where it stands.
        role: What it may do.
        name: Of the machine or function.
        hosts: Names and addresses that others may connect to it by.
        expires: End of its validity.
        access: Who may do what here; None for those whom nobody connects to.
    """

    folder: Path
    role: Role
    name: str
    hosts: tuple[str, ...]
    expires: datetime
    access: AccessList | None

    @property
    def ca(self) -> Path:
        """The authority's certificate."""
        return self.folder / CA_FILE

    @property
    def certificate(self) -> Path:
        """The certificate."""
        return self.folder / CERTIFICATE_FILE

    @property
    def key(self) -> Path:
        """The private key."""
        return self.folder / KEY_FILE

    def expires_soon(self, now: datetime) -> bool:
        """Whether it is time to renew it."""
        return self.expires - now < EXPIRES_SOON


def use_identity(folder: Path) -> Identity:
    """Return the identity in a folder, checked; logs a warning when it is about to expire.

    Raises:
        BadInputError: It cannot be used; names the file and the remedy.
        GhestError: The extra `security` is not installed.
    """
    need_extra("security", "a connection with TLS")
    from ghest_rt.security.identity_check import load_identity  # noqa: PLC0415  (needs the extra `security`)

    identity, now = load_identity(folder), datetime.now(UTC)
    if identity.expires_soon(now):
        name = f"{identity.role}.{identity.name}"
        _log.warning("%s expires on %s: renew it (ghest-rt certs renew %s)", name, f"{identity.expires:%Y-%m-%d}", name)
    return identity
