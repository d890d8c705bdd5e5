"""Zenoh sessions as an attacker opens them: with whatever settings, past our own checks."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import zenoh

from ghest_rt.security.identity import CA_FILE, CERTIFICATE_FILE, KEY_FILE


def open_raw(
    connect: Sequence[str] = (),
    listen: Sequence[str] = (),
    identity: Path | None = None,
    ca: Path | None = None,
    mode: str = "peer",
) -> zenoh.Session:
    """Open a session with an identity's files unchecked, or with a CA alone, or without TLS.

    A peer sends only what the other side says it wants; a client (mode) sends everything.
    """
    settings: dict[str, Any] = {
        "mode": mode,
        "listen/endpoints": list(listen),
        "connect/endpoints": list(connect),
        "connect/exit_on_failure": False,
        "connect/timeout_ms": 2000,
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
    }
    if identity is not None:
        certificate, key = str(identity / CERTIFICATE_FILE), str(identity / KEY_FILE)
        settings["transport/link/tls"] = {
            "root_ca_certificate": str(identity / CA_FILE),
            "enable_mtls": True,
            "verify_name_on_connect": True,
            "connect_certificate": certificate,
            "connect_private_key": key,
            "listen_certificate": certificate,
            "listen_private_key": key,
        }
    elif ca is not None:
        settings["transport/link/tls"] = {"root_ca_certificate": str(ca), "verify_name_on_connect": True}
    config = zenoh.Config()
    for path, value in settings.items():
        config.insert_json5(path, json.dumps(value))
    return zenoh.open(config)
