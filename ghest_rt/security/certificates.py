"""X.509 certificates of a clinic (RFC 5280): its own authority (CA) and the identities that it signs."""

import ipaddress
from collections.abc import Sequence
from datetime import datetime, timedelta

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from ghest_rt.errors import BadInputError
from ghest_rt.security.roles import SERVER_ROLES, Role, common_name

PrivateKey = ec.EllipticCurvePrivateKey

_BACKDATED = timedelta(minutes=5)  # clocks in a clinic differ


def new_key() -> PrivateKey:
    """Return a new private key (NIST P-256: what every TLS library of the field takes)."""
    return ec.generate_private_key(ec.SECP256R1())


def key_to_pem(key: PrivateKey) -> bytes:
    """Return a private key as PKCS #8 PEM, not encrypted: Zenoh reads it unattended, the file's mode protects it."""
    return key.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())


def certificate_to_pem(certificate: x509.Certificate) -> bytes:
    """Return a certificate as PEM."""
    return certificate.public_bytes(serialization.Encoding.PEM)


def make_authority(clinic: str, key: PrivateKey, now: datetime, days: int) -> x509.Certificate:
    """Return a clinic's self-signed authority: it can sign identities, and no further authority (path length 0)."""
    name = x509.Name(
        [x509.NameAttribute(NameOID.ORGANIZATION_NAME, clinic), x509.NameAttribute(NameOID.COMMON_NAME, "ghest-rt CA")]
    )
    return (
        _builder(name, name, key, now, now + timedelta(days=days))
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(_key_usage(signs_certificates=True), critical=True)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
        .sign(key, hashes.SHA256())
    )


def make_identity(
    authority: x509.Certificate,
    authority_key: PrivateKey,
    key: PrivateKey,
    role: Role,
    name: str,
    *,
    hosts: Sequence[str],
    now: datetime,
    days: int,
) -> x509.Certificate:
    """Return the certificate of an identity, valid for no longer than its authority.

    Args:
        authority: Who signs.
        authority_key: Its key.
        key: The identity's key; only its public half is used.
        role: What it may do. Only stations and routers get a certificate that is good for a server.
        name: Of the machine or function.
        hosts: DNS names and IP addresses under which others connect to it; only for stations and routers.
        now: Present time, with time zone.
        days: How long it holds.

    Raises:
        BadInputError: The name is not allowed, or hosts are missing, malformed, or given to a role nobody connects to.
    """
    server = role in SERVER_ROLES
    cn = common_name(role, name)
    if server and not hosts:
        raise BadInputError(
            f"{cn}: name the host that others connect to: --host bed-1.clinic.lan, --host 10.20.0.5 (may be repeated)"
        )
    if hosts and not server:
        raise BadInputError(f"{cn}: nobody connects to a {role}; leave --host out")
    subject = x509.Name(
        [
            *authority.subject.get_attributes_for_oid(NameOID.ORGANIZATION_NAME),
            x509.NameAttribute(NameOID.ORGANIZATIONAL_UNIT_NAME, role.value),
            x509.NameAttribute(NameOID.COMMON_NAME, cn),
        ]
    )
    usages = [ExtendedKeyUsageOID.CLIENT_AUTH, *([ExtendedKeyUsageOID.SERVER_AUTH] if server else [])]
    # Everyone has a SAN: TLS libraries do not look at common names. A client's cannot be connected to.
    alternative = [_host(host) for host in hosts] or [x509.DNSName(f"{name}.{role}.invalid")]
    issuer_id = x509.AuthorityKeyIdentifier.from_issuer_public_key(authority_key.public_key())
    return (
        _builder(subject, authority.subject, key, now, min(now + timedelta(days=days), authority.not_valid_after_utc))
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_key_usage(signs_certificates=False), critical=True)
        .add_extension(x509.ExtendedKeyUsage(usages), critical=False)
        .add_extension(x509.SubjectAlternativeName(alternative), critical=False)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
        .add_extension(issuer_id, critical=False)
        .sign(authority_key, hashes.SHA256())
    )


def name_of(certificate: x509.Certificate) -> str:
    """Return the common name of a certificate; "" without one."""
    found = certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    return str(found[0].value) if found else ""


def hosts_of(certificate: x509.Certificate) -> tuple[str, ...]:
    """Return the DNS names and IP addresses of a certificate, without the placeholder of clients."""
    try:
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return ()
    found = (*names.get_values_for_type(x509.DNSName), *map(str, names.get_values_for_type(x509.IPAddress)))
    return tuple(host for host in found if not host.endswith(".invalid"))


def _builder(subject: x509.Name, issuer: x509.Name, key: PrivateKey, now: datetime, end: datetime) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - _BACKDATED)
        .not_valid_after(end)
    )


def _key_usage(signs_certificates: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs_certificates,
        key_cert_sign=signs_certificates,
        crl_sign=signs_certificates,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        encipher_only=False,
        decipher_only=False,
    )


def _host(text: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(text))
    except ValueError:
        pass
    labels = text.split(".")
    if len(text) > 253 or not all(_label(label) for label in labels):
        raise BadInputError(
            f"{text!r} is neither a host name nor an IP address; write --host bed-1.clinic.lan or --host 10.20.0.5"
        )
    return x509.DNSName(text)


def _label(label: str) -> bool:
    plain = label.replace("-", "")
    return 0 < len(label) < 64 and label.isascii() and plain.isalnum() and not label.startswith("-") and not label.endswith("-")
