"""Read an identity and check it before anything is opened with it (needs the extra `security`).

Zenoh's side of a failed handshake is a time-out; whatever can be told beforehand is told here.
"""

from datetime import UTC, datetime
from pathlib import Path

from cryptography import x509
from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.hazmat.primitives.serialization import load_pem_private_key
from cryptography.x509.oid import ExtendedKeyUsageOID

from ghest_rt.errors import BadInputError, NotPermittedError
from ghest_rt.security.access import ACCESS_FILE, load_access
from ghest_rt.security.certificates import hosts_of, name_of
from ghest_rt.security.files import check_secret, read_small
from ghest_rt.security.identity import CA_FILE, CERTIFICATE_FILE, KEY_FILE, Identity
from ghest_rt.security.roles import SERVER_ROLES, parse_common_name


def load_identity(folder: Path, now: datetime | None = None) -> Identity:
    """Read an identity and check that it can be used now.

    Args:
        folder: As written by `ghest-rt certs issue`.
        now: Present time, with time zone; default the system's.

    Raises:
        BadInputError: A file is missing or malformed; the certificate is not yet or no longer valid, or another authority's;
            the key is another's or readable by others; a station has no access list. Names the file and the remedy.
        NotPermittedError: This user may not read it.
    """
    now = datetime.now(UTC) if now is None else now
    try:
        there = (folder / CERTIFICATE_FILE).exists()
    except PermissionError as error:
        raise NotPermittedError(f"{folder}: cannot look for an identity here: {error.strerror}") from error
    if not there:
        raise BadInputError(f"{folder}: no identity here; name a folder that ghest-rt certs issue made")
    authority = load_certificate(folder / CA_FILE)
    path = folder / CERTIFICATE_FILE
    certificate = load_certificate(path)
    check_times(folder / CA_FILE, authority, now, "make a new authority: ghest-rt certs init")
    _check_issuer(path, certificate, authority)
    try:
        role, name = parse_common_name(name_of(certificate))
    except BadInputError as error:
        raise BadInputError(f"{path}: {error}") from error
    check_times(path, certificate, now, f"renew it: ghest-rt certs renew {role}.{name}")
    if role in SERVER_ROLES and ExtendedKeyUsageOID.SERVER_AUTH not in _usages(certificate):
        raise BadInputError(f"{path}: the certificate of a {role} must be good for a server; issue it anew")
    _check_key(folder / KEY_FILE, certificate)
    access = load_access(folder / ACCESS_FILE) if role in SERVER_ROLES else None
    return Identity(folder, role, name, hosts_of(certificate), certificate.not_valid_after_utc, access)


def load_certificate(path: Path) -> x509.Certificate:
    """Read a certificate.

    Raises:
        BadInputError: The file is missing, or is no certificate.
    """
    try:
        return x509.load_pem_x509_certificate(read_small(path, "certificate"))
    except ValueError as error:
        raise BadInputError(f"{path}: not a certificate in PEM form; copy the identity's whole folder again") from error


def check_times(path: Path, certificate: x509.Certificate, now: datetime, remedy: str) -> None:
    """Refuse a certificate that does not hold now.

    Raises:
        BadInputError: It has expired, or is not valid yet.
    """
    begins, ends = certificate.not_valid_before_utc, certificate.not_valid_after_utc
    if now > ends:
        raise BadInputError(f"{path}: the certificate of {name_of(certificate)} expired on {ends:%Y-%m-%d %H:%M} UTC; {remedy}")
    if now < begins:
        raise BadInputError(
            f"{path}: the certificate of {name_of(certificate)} is not valid before {begins:%Y-%m-%d %H:%M} UTC, "
            f"and this machine's clock says {now:%Y-%m-%d %H:%M}; set the clock"
        )


def _check_issuer(path: Path, certificate: x509.Certificate, authority: x509.Certificate) -> None:
    try:
        certificate.verify_directly_issued_by(authority)
    except (ValueError, TypeError, InvalidSignature) as error:
        raise BadInputError(
            f"{path}: this certificate was not signed by the authority in {CA_FILE}; copy the identity's whole folder again"
        ) from error


def _check_key(path: Path, certificate: x509.Certificate) -> None:
    check_secret(path)
    try:
        key = load_pem_private_key(read_small(path, "private key"), password=None)
    except (ValueError, TypeError, UnsupportedAlgorithm) as error:
        raise BadInputError(
            f"{path}: not an unencrypted private key in PEM form; copy the identity's whole folder again"
        ) from error
    if key.public_key() != certificate.public_key():
        raise BadInputError(f"{path}: this key does not belong to {CERTIFICATE_FILE}; copy the identity's whole folder again")


def _usages(certificate: x509.Certificate) -> list[x509.ObjectIdentifier]:
    try:
        return list(certificate.extensions.get_extension_for_class(x509.ExtendedKeyUsage).value)
    except x509.ExtensionNotFound:
        return []
