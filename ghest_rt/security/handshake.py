"""Shake hands with a station by plain TLS, to say why it refuses: Zenoh itself only tries again and again."""

import socket
import ssl

from ghest_rt.errors import BadInputError, GhestError
from ghest_rt.security.endpoints import split_endpoint
from ghest_rt.security.identity import Identity

_TIMEOUT_S = 3.0
_REFUSALS = {
    "certificate_required": "it wants a certificate and got none",
    "unknown_ca": "our certificate is another authority's than the station's",
    "certificate_expired": "our certificate has expired by the station's clock",
    "certificate_unknown": "it does not accept our certificate",
    "bad_certificate": "it does not accept our certificate",
    "decrypt_error": "our certificate is another authority's than the station's, of the same name",
    "unsupported_certificate": "our certificate is not good for a client",
    "access_denied": "it does not accept our certificate",
}


def try_handshake(endpoint: str, identity: Identity) -> None:
    """Complete a TLS handshake with a station, and close.

    Raises:
        BadInputError: The endpoint is malformed, or without TLS.
        GhestError: It does not come about; says which side refuses and why.
    """
    protocol, host, port = split_endpoint(endpoint)
    who = f"{identity.role}.{identity.name}"
    if protocol != "tls":
        raise BadInputError(f"{endpoint}: with an identity connect to tls/{host}:{port}")
    context = ssl.create_default_context(ssl.Purpose.SERVER_AUTH, cafile=str(identity.ca))
    context.load_cert_chain(identity.certificate, identity.key)
    try:
        with (
            socket.create_connection((host, port), timeout=_TIMEOUT_S) as plain,
            context.wrap_socket(plain, server_hostname=host) as link,
        ):
            # In TLS 1.3 the server's verdict on our certificate comes after the handshake; silence is consent.
            link.settimeout(0.3)
            try:
                link.recv(1)
            except TimeoutError:
                return
    except ssl.SSLCertVerificationError as error:
        raise GhestError(
            f"{endpoint}: {who} does not trust the station ({error.verify_message}): is it the right host, "
            "of the same clinic's authority, and its certificate in force?"
        ) from error
    except ssl.SSLError as error:
        raise GhestError(f"{endpoint}: the station refuses {who}: {_words(error)}") from error
    except TimeoutError as error:
        raise GhestError(f"{endpoint}: no answer within {_TIMEOUT_S:g} s; is it a station's TLS port?") from error
    except ConnectionResetError as error:
        raise GhestError(f"{endpoint}: the other side hung up; does it speak TLS?") from error
    except OSError as error:
        raise GhestError(f"{endpoint}: cannot be reached: {error.strerror or error}") from error


def _words(error: ssl.SSLError) -> str:
    reason = (error.reason or str(error)).lower()
    known = (words for name, words in _REFUSALS.items() if name in reason.replace(" ", "_"))
    if "wrong_version_number" in reason or "record_layer_failure" in reason:
        return "it does not speak TLS"
    return next(known, reason)
