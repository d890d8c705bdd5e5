"""What `ghest-rt certs` makes, and that an identity which cannot be used is refused by name before anything is opened."""

import json
import shutil
import stat
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.x509.oid import ExtendedKeyUsageOID
from typer.testing import CliRunner

from ghest_rt.cli.main import app
from ghest_rt.errors import BadInputError, GhestError
from ghest_rt.security.access import load_access
from ghest_rt.security.authority import Authority
from ghest_rt.security.identity import use_identity
from ghest_rt.security.identity_check import load_certificate, load_identity
from ghest_rt.security.roles import Role
from ghest_rt.security.session import open_session, session_settings
from tests.security.clinic import Clinic

NOW = datetime(2026, 5, 1, 12, 0, tzinfo=UTC)


@pytest.fixture
def authority(tmp_path: Path) -> Authority:
    return Authority.create(tmp_path / "pki", "Clinic A", 3650, NOW)


def certs(*arguments: object) -> str:
    result = CliRunner().invoke(app, ["certs", *map(str, arguments)], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


def test_private_keys_are_for_their_owner_alone(authority: Authority) -> None:
    folder = authority.issue(Role.STATION, "bed-1", ("bed-1.lan",), 100)
    for key in (folder / "key.pem", authority.folder / "ca-key.pem"):
        assert stat.S_IMODE(key.stat().st_mode) == 0o600
    assert stat.S_IMODE(folder.stat().st_mode) & 0o077 == 0


def test_certificates_say_what_their_role_needs_and_no_more(authority: Authority) -> None:
    ca = load_certificate(authority.folder / "ca.pem")
    constraints = ca.extensions.get_extension_for_class(x509.BasicConstraints)
    assert constraints.critical
    assert (constraints.value.ca, constraints.value.path_length) == (True, 0)
    serials = set()
    for role, hosts, server in ((Role.STATION, ("bed-1.lan", "10.20.0.5"), True), (Role.THERAPY, (), False)):
        certificate = load_certificate(authority.issue(role, "one", hosts, 100) / "certificate.pem")
        extensions = certificate.extensions
        certificate.verify_directly_issued_by(ca)
        assert not extensions.get_extension_for_class(x509.BasicConstraints).value.ca
        assert not extensions.get_extension_for_class(x509.KeyUsage).value.key_cert_sign
        usages = set(extensions.get_extension_for_class(x509.ExtendedKeyUsage).value)
        assert usages == {ExtendedKeyUsageOID.CLIENT_AUTH} | ({ExtendedKeyUsageOID.SERVER_AUTH} if server else set())
        assert extensions.get_extension_for_class(x509.SubjectAlternativeName)
        assert certificate.not_valid_after_utc - NOW == timedelta(days=100)
        serials.add(certificate.serial_number)
    assert len(serials) == 2
    assert min(serials) > 2**100


def test_an_identity_does_not_outlive_its_authority(tmp_path: Path) -> None:
    authority = Authority.create(tmp_path, "Clinic A", 10, NOW)
    folder = authority.issue(Role.THERAPY, "game-1", (), 365)
    assert load_identity(folder, NOW).expires == authority.expires


@pytest.mark.parametrize(
    ("role", "name", "hosts", "days", "says"),
    [
        (Role.THERAPY, "Jane Doe", (), 10, "not a person"),
        (Role.THERAPY, "../../etc/x", (), 10, "lower-case letters"),
        (Role.THERAPY, "game-1", ("host",), 10, "leave --host out"),
        (Role.STATION, "bed-1", (), 10, "--host"),
        (Role.STATION, "bed-1", ("bed 1",), 10, "neither a host name nor an IP address"),
        (Role.STATION, "bed-1", ("*.lan",), 10, "neither a host name"),
        (Role.THERAPY, "game-1", (), 0, "--days 0"),
        (Role.THERAPY, "game-1", (), 100_000, "between 1 and 825"),
        (Role.THERAPY, "known", (), 10, "renew it"),
        (Role.THERAPY, "gone", (), 10, "another name"),
    ],
)
def test_what_cannot_be_issued_is_refused_with_a_remedy(  # noqa: PLR0917
    authority: Authority, role: Role, name: str, hosts: tuple[str, ...], days: int, says: str
) -> None:
    authority.issue(Role.THERAPY, "known", (), 10)
    authority.issue(Role.THERAPY, "gone", (), 10)
    authority.revoke("therapy.gone")
    before = [entry.common_name for entry in authority.issued()]
    with pytest.raises(BadInputError, match=says.replace("*", r"\*")):
        authority.issue(role, name, hosts, days)
    assert [entry.common_name for entry in Authority(authority.folder, NOW).issued()] == before


def test_a_second_authority_does_not_replace_the_first(authority: Authority) -> None:
    with pytest.raises(BadInputError, match="lock out every identity"):
        Authority.create(authority.folder, "Clinic A", 10, NOW)


def test_revoking_takes_the_name_off_every_stations_list(authority: Authority) -> None:
    station = authority.issue(Role.STATION, "bed-1", ("bed-1.lan",), 100)
    authority.issue(Role.THERAPY, "game-1", (), 100)
    before = load_access(station / "access.json")
    assert before.of(Role.THERAPY) == ["therapy.game-1"]
    Authority(authority.folder, NOW).revoke("therapy.game-1")
    after = load_access(station / "access.json")
    assert (after.of(Role.THERAPY), after.of(Role.STATION)) == ([], ["station.bed-1"])
    assert after.number > before.number
    for again in (lambda a: a.revoke("therapy.game-1"), lambda a: a.renew("therapy.game-1", 10)):
        with pytest.raises(BadInputError, match="was revoked"):
            again(Authority(authority.folder, NOW))


def test_renewing_gives_a_new_key_and_keeps_name_and_hosts(authority: Authority) -> None:
    folder = authority.issue(Role.STATION, "bed-1", ("bed-1.lan",), 10)
    old = (folder / "key.pem").read_bytes()
    later = NOW + timedelta(days=9)
    assert Authority(authority.folder, later).renew("station.bed-1", 10) == folder
    assert (folder / "key.pem").read_bytes() != old
    renewed = load_identity(folder, later)
    assert (renewed.name, renewed.hosts, renewed.expires) == ("bed-1", ("bed-1.lan",), later + timedelta(days=10))


def test_an_expired_authority_signs_nothing(authority: Authority) -> None:
    late = Authority(authority.folder, NOW + timedelta(days=4000))
    with pytest.raises(BadInputError, match="expired"):
        late.issue(Role.THERAPY, "game-1", (), 10)


def _swap(name: str) -> Callable[[Path, Path], None]:
    return lambda folder, other: shutil.copy(other / name, folder / name) and None


@pytest.mark.parametrize(
    ("spoil", "at", "says"),
    [
        (
            lambda folder, _: None,
            NOW + timedelta(days=101),
            ["certificate.pem", "expired on 2026-08-09", "certs renew station.bed-1"],
        ),
        (lambda folder, _: None, NOW - timedelta(days=1), ["ca.pem", "not valid before", "clock"]),
        (_swap("ca.pem"), NOW, ["certificate.pem", "not signed by the authority in ca.pem"]),
        (_swap("key.pem"), NOW, ["key.pem", "does not belong to certificate.pem"]),
        (lambda folder, _: (folder / "key.pem").chmod(0o644), NOW, ["key.pem", "mode 0644", "chmod 600"]),
        (lambda folder, _: (folder / "key.pem").unlink(), NOW, ["key.pem", "No such file"]),
        (lambda folder, _: (folder / "key.pem").write_text("x"), NOW, ["key.pem", "not an unencrypted private key"]),
        (lambda folder, _: (folder / "certificate.pem").write_text("x"), NOW, ["certificate.pem", "not a certificate"]),
        (
            lambda folder, _: (folder / "access.json").unlink(),
            NOW,
            ["access.json", "no such file; copy access.json of the authority"],
        ),
        (lambda folder, _: (folder / "access.json").write_text("{}"), NOW, ["access.json", "not an access list"]),
        (lambda folder, _: (folder / "ca.pem").write_bytes(bytes(2_000_000)), NOW, ["ca.pem", "larger than 1000000 bytes"]),
    ],
)
def test_an_identity_that_cannot_be_used_is_refused_by_file_and_remedy(
    tmp_path: Path, authority: Authority, spoil: Callable[[Path, Path], None], at: datetime, says: list[str]
) -> None:
    folder = authority.issue(Role.STATION, "bed-1", ("bed-1.lan",), 100)
    other = Authority.create(tmp_path / "other", "Clinic B", 3650, NOW).issue(Role.STATION, "bed-1", ("bed-1.lan",), 100)
    assert load_identity(folder, NOW).name == "bed-1"
    spoil(folder, other)
    with pytest.raises(BadInputError) as caught:
        load_identity(folder, at)
    assert str(caught.value).startswith(str(folder))
    assert [text for text in says if text not in str(caught.value)] == []


def test_an_identity_about_to_expire_is_told(clinic: Clinic, caplog: pytest.LogCaptureFixture, tmp_path: Path) -> None:
    use_identity(clinic.station)
    assert not caplog.records
    folder = Authority.create(tmp_path, "Clinic A", 3650).issue(Role.THERAPY, "game-1", (), 20)
    use_identity(folder)
    assert "therapy.game-1 expires on" in caplog.text


@pytest.mark.parametrize(
    ("listen", "connect", "who", "says"),
    [
        (("tcp/0.0.0.0:7447",), (), None, "leaves this machine"),
        (("tcp/[::]:7447",), (), None, "leaves this machine"),
        ((), ("tcp/bed-1.lan:7447",), None, "leaves this machine"),
        (("tls/127.0.0.1:7447",), (), None, "needs an identity"),
        (("tcp/127.0.0.1:7447",), (), "station", "every endpoint is tls/host:port"),
        (("tls/127.0.0.1:7447",), (), "therapy", "cannot listen on"),
    ],
)
def test_nothing_leaves_the_machine_without_tls_and_identity(
    clinic: Clinic, listen: tuple[str, ...], connect: tuple[str, ...], who: str | None, says: str
) -> None:
    identity = None if who is None else load_identity(getattr(clinic, who))
    with pytest.raises(BadInputError, match=says):
        open_session(listen, connect, identity)


def test_a_stations_session_denies_by_default(clinic: Clinic) -> None:
    control = session_settings(("tls/127.0.0.1:0",), (), load_identity(clinic.station))["access_control"]
    assert control["enabled"]
    assert control["default_permission"] == "deny"
    assert all(rule["key_exprs"] and "**" not in rule["key_exprs"] for rule in control["rules"])
    (therapy,) = (policy for policy in control["policies"] if policy["subjects"] == ["therapy"])
    rules = {rule["id"]: rule for rule in control["rules"]}
    let_in = {
        message for name in therapy["rules"] for message in rules[name]["messages"] if rules[name]["flows"] == ["ingress"]
    }
    assert let_in == {"declare_subscriber", "declare_liveliness_subscriber", "liveliness_query", "query"}


def test_the_commands(tmp_path: Path) -> None:
    pki = tmp_path / "pki"
    assert "valid until" in certs("init", "--pki", pki, "--clinic", "Clinic [A]")
    station = certs("issue", "--pki", pki, "--role", "station", "bed-1", "--host", "localhost")
    assert "carry" in station
    assert "access.json" in station
    certs("issue", "--pki", pki, "--role", "therapy", "game-1")
    certs("renew", "--pki", pki, "therapy.game-1", "--days", 5)
    assert "can be used until" in certs("check", pki / "identities" / "therapy.game-1")
    assert "revoked" in certs("revoke", "--pki", pki, "therapy.game-1")
    document = json.loads(certs("list", "--pki", pki, "--json"))
    assert document["clinic"] == "Clinic [A]"
    states = [(entry["common_name"], entry["state"]) for entry in document["identities"]]
    assert states == [("station.bed-1", "valid"), ("therapy.game-1", "revoked"), ("therapy.game-1", "revoked")]
    assert "therapy.game-1" in certs("list", "--pki", pki)
    with pytest.raises(GhestError, match="no authority here"):
        certs("list", "--pki", tmp_path / "nowhere")
