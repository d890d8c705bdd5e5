"""The clinic's authority: a folder with its key, its book of identities and its access list (needs the extra `security`).

ca.pem, ca-key.pem       the authority
authority.json           every certificate ever issued
access.json              who may do what now; stations and routers get a copy
identities/<role>.<name>/   ca.pem, certificate.pem, key.pem (and access.json): to be carried to its machine
"""

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import load_pem_private_key
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ghest_rt.errors import BadInputError
from ghest_rt.security.access import ACCESS_FILE, AccessList, access_to_json
from ghest_rt.security.certificates import (
    PrivateKey,
    certificate_to_pem,
    key_to_pem,
    make_authority,
    make_identity,
    new_key,
)
from ghest_rt.security.files import PUBLIC_MODE, SECRET_MODE, check_secret, make_folder, read_small, write_whole
from ghest_rt.security.identity import CA_FILE, CERTIFICATE_FILE, KEY_FILE
from ghest_rt.security.identity_check import check_times, load_certificate
from ghest_rt.security.roles import SERVER_ROLES, Role, common_name, parse_common_name

CA_KEY_FILE = "ca-key.pem"
BOOK_FILE = "authority.json"
IDENTITIES = "identities"

MAX_DAYS = 825
"""Longest life of an identity; an authority may live ten times as long."""


class Issued(BaseModel):
    """One certificate in the book.

    Attributes:
        common_name: Role and name.
        serial: Of the certificate, hexadecimal.
        hosts: What others connect to it by.
        issued: When.
        expires: When.
        revoked: When, or None.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    common_name: str
    serial: str
    hosts: tuple[str, ...]
    issued: datetime
    expires: datetime
    revoked: datetime | None = None

    def state(self, now: datetime) -> str:
        """Return "revoked", "expired" or "valid"."""
        if self.revoked is not None:
            return "revoked"
        return "expired" if now > self.expires else "valid"


class _Book(BaseModel):
    model_config = ConfigDict(extra="forbid")

    format: int = Field(default=1, ge=1, le=1)
    clinic: str
    number: int = 0
    issued: list[Issued] = []


class Authority:
    """Issues, renews and revokes identities.

    Args:
        folder: Of the authority.
        now: Present time, with time zone; default the system's.

    Raises:
        BadInputError: There is no authority in the folder, its key is readable by others, or a file is damaged.
    """

    def __init__(self, folder: Path, now: datetime | None = None) -> None:
        self.folder = folder
        self._now = datetime.now(UTC) if now is None else now
        if not (folder / BOOK_FILE).exists():
            raise BadInputError(f"{folder}: no authority here; make one: ghest-rt certs init --pki {folder} --clinic NAME")
        self._certificate = load_certificate(folder / CA_FILE)
        self._key = _load_key(folder / CA_KEY_FILE)
        try:
            self._book = _Book.model_validate_json(read_small(folder / BOOK_FILE, "authority's book"))
        except ValidationError as error:
            raise BadInputError(
                f"{folder / BOOK_FILE}: damaged ({error.error_count()} problems); restore it from a copy"
            ) from error

    @classmethod
    def create(cls, folder: Path, clinic: str, days: int, now: datetime | None = None) -> "Authority":
        """Make a new authority.

        Raises:
            BadInputError: There is one already, the folder cannot be written, or the clinic's name is unusable.
        """
        now = datetime.now(UTC) if now is None else now
        _check_days(days, 10 * MAX_DAYS)
        if not 0 < len(clinic.strip()) <= 64 or not clinic.isprintable():
            raise BadInputError(f"{clinic!r}: the clinic's name is 1 to 64 printable characters")
        for file in (BOOK_FILE, CA_KEY_FILE, CA_FILE):
            if (folder / file).exists():
                raise BadInputError(
                    f"{folder / file} exists: a second authority in its place would lock out every identity of the first; "
                    "name another folder"
                )
        make_folder(folder, 0o700)
        make_folder(folder / IDENTITIES, 0o700)
        key = new_key()
        certificate = make_authority(clinic.strip(), key, now, days)
        write_whole(folder / CA_KEY_FILE, key_to_pem(key), SECRET_MODE)
        write_whole(folder / CA_FILE, certificate_to_pem(certificate), PUBLIC_MODE)
        _write_book(folder, _Book(clinic=clinic.strip()), now)
        return cls(folder, now)

    @property
    def clinic(self) -> str:
        """Whose authority this is."""
        return self._book.clinic

    @property
    def expires(self) -> datetime:
        """End of the authority's own validity."""
        return self._certificate.not_valid_after_utc

    def issued(self) -> tuple[Issued, ...]:
        """Return every certificate ever issued, oldest first."""
        return tuple(self._book.issued)

    def issue(self, role: Role, name: str, hosts: Sequence[str], days: int) -> Path:
        """Make an identity and return its folder.

        Raises:
            BadInputError: The name is not allowed, in use or revoked; hosts are missing or not wanted; the authority
                has expired.
        """
        cn = common_name(role, name)
        if any(entry.common_name == cn for entry in self._book.issued):
            known = self._newest(cn)
            remedy = (
                "renew it: ghest-rt certs renew" if known.revoked is None else "take another name: the old certificate bears it"
            )
            raise BadInputError(f"{cn} has been issued before ({known.state(self._now)}); {remedy}")
        return self._sign(role, name, hosts, days)

    def renew(self, cn: str, days: int, hosts: Sequence[str] = ()) -> Path:
        """Make an identity's new key and certificate, with the old one's hosts unless others are given; return its folder.

        Raises:
            BadInputError: There is no such identity, or it was revoked; the authority has expired.
        """
        role, name = parse_common_name(cn)
        known = self._newest(cn)
        if known.revoked is not None:
            raise BadInputError(f"{cn} was revoked on {known.revoked:%Y-%m-%d}; issue one under another name")
        return self._sign(role, name, hosts or known.hosts, days)

    def revoke(self, cn: str) -> None:
        """Take an identity off the access list for good; stations and routers must get the new list.

        Raises:
            BadInputError: There is no such identity, or it was revoked before.
        """
        known = self._newest(cn)
        if known.revoked is not None:
            raise BadInputError(f"{cn} was revoked on {known.revoked:%Y-%m-%d} already")
        self._book.issued = [
            entry.model_copy(update={"revoked": self._now}) if entry.common_name == cn else entry for entry in self._book.issued
        ]
        self._changed()

    def lists(self) -> list[Path]:
        """Return the copies of the access list that stations and routers must get."""
        names = sorted({entry.common_name for entry in self._book.issued if entry.revoked is None})
        return [self.folder / IDENTITIES / cn / ACCESS_FILE for cn in names if parse_common_name(cn)[0] in SERVER_ROLES]

    def _newest(self, cn: str) -> Issued:
        found = [entry for entry in self._book.issued if entry.common_name == cn]
        if not found:
            known = ", ".join(sorted({entry.common_name for entry in self._book.issued})) or "none yet"
            raise BadInputError(f"{self.folder}: no identity {cn!r} was issued here; there are: {known}")
        return found[-1]

    def _sign(self, role: Role, name: str, hosts: Sequence[str], days: int) -> Path:
        _check_days(days, MAX_DAYS)
        check_times(self.folder / CA_FILE, self._certificate, self._now, "make a new authority in another folder")
        cn, key = common_name(role, name), new_key()
        certificate = make_identity(self._certificate, self._key, key, role, name, hosts=hosts, now=self._now, days=days)
        self._book.issued.append(
            Issued(
                common_name=cn,
                serial=f"{certificate.serial_number:x}",
                hosts=tuple(hosts),
                issued=self._now,
                expires=certificate.not_valid_after_utc,
            )
        )
        folder = self.folder / IDENTITIES / cn
        make_folder(folder, 0o700)
        write_whole(folder / KEY_FILE, key_to_pem(key), SECRET_MODE)
        write_whole(folder / CERTIFICATE_FILE, certificate_to_pem(certificate), PUBLIC_MODE)
        write_whole(folder / CA_FILE, certificate_to_pem(self._certificate), PUBLIC_MODE)
        self._changed()
        return folder

    def _changed(self) -> None:
        """Write the book and every copy of the access list."""
        self._book.number += 1
        text = _write_book(self.folder, self._book, self._now)
        for path in self.lists():
            make_folder(path.parent, 0o700)  # the rest may have been carried away
            write_whole(path, text, PUBLIC_MODE)


def _write_book(folder: Path, book: _Book, now: datetime) -> bytes:
    """Write book and access list and return the latter's text. Expired identities stay on it: TLS refuses them."""
    allowed = tuple(sorted({entry.common_name for entry in book.issued if entry.revoked is None}))
    access = AccessList(format=1, clinic=book.clinic, written=now, number=book.number, allowed=allowed)
    write_whole(folder / BOOK_FILE, (book.model_dump_json(indent=2) + "\n").encode(), SECRET_MODE)
    text = access_to_json(access)
    write_whole(folder / ACCESS_FILE, text, PUBLIC_MODE)
    return text


def _load_key(path: Path) -> PrivateKey:
    check_secret(path)
    try:
        key = load_pem_private_key(read_small(path, "authority's key"), password=None)
    except (ValueError, TypeError) as error:
        raise BadInputError(f"{path}: not a private key in PEM form; restore it from a copy") from error
    if not isinstance(key, ec.EllipticCurvePrivateKey):
        raise BadInputError(f"{path}: not the key that ghest-rt certs made; restore it from a copy")
    return key


def _check_days(days: int, most: int) -> None:
    if not 1 <= days <= most:
        raise BadInputError(f"--days {days}: between 1 and {most}")
