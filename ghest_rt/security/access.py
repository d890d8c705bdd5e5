"""Who may do what at a station: the access list, and the rules of Zenoh's access control made of it.

Zenoh checks certificates when a link opens, but knows no revocation lists. So everybody is denied who is not listed by name
(deny by default): to revoke an identity is to take its name off the list.
"""

import json
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ghest_rt.errors import BadInputError
from ghest_rt.security.files import read_small
from ghest_rt.security.roles import Role

ACCESS_FILE = "access.json"

_CommonName = Annotated[str, Field(pattern=r"^(station|therapy|operator|router)\.[a-z0-9][a-z0-9-]{0,39}$")]

# Named one by one: Zenoh lets a query pass if its key expression lies within an allowed one, and a query for ghest/** would
# reach what ghest/*/calibrate/** forbids.
ASKED_KEYS = tuple(f"ghest/*/{tail}" for tail in ("schema", "config", "calibration", "last", "gh/**"))
"""What may be asked for."""

_HEARD = ("gh/**", "health", "events", "@adv/**")
_CALIBRATE = ("ghest/*/calibrate/**",)


class AccessList(BaseModel):
    """The identities of a clinic that were not revoked when this was written (TLS itself refuses those that have expired).

    Attributes:
        format: 1.
        clinic: Whose authority wrote it.
        written: When.
        number: Counts the lists of this authority: the higher one is the newer.
        allowed: Common names.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    format: int = Field(ge=1, le=1)
    clinic: str = Field(max_length=200)
    written: datetime
    number: int = Field(ge=0)
    allowed: tuple[_CommonName, ...] = Field(max_length=1000)

    def of(self, role: Role) -> list[str]:
        """Return the common names with a role."""
        return [name for name in self.allowed if name.startswith(f"{role}.")]


def load_access(path: Path) -> AccessList:
    """Read an access list.

    Raises:
        BadInputError: It is missing or is none.
    """
    if not path.exists():
        raise BadInputError(f"{path}: no such file; copy {ACCESS_FILE} of the authority's folder there")
    try:
        return AccessList.model_validate_json(read_small(path, "access list"))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(map(str, first["loc"])) or "(file)"
        raise BadInputError(
            f"{path}: not an access list: {place}: {first['msg']}; take {ACCESS_FILE} of the authority's folder"
        ) from error


def access_control(access: AccessList, gateway: bool = False) -> dict[str, Any]:
    """Return Zenoh's `access_control` for a station or a router: what comes from whom is let in, and what goes out to whom.

    Args:
        access: Who may do what.
        gateway: Whether the stations are connected to on this machine without TLS; nobody else has a link like that.

    A station behind a router sees the router's name only; so a router may pass on what an operator may, and tells therapy
    software and operators apart itself.
    """
    heard, asked = _keys(*_HEARD), [*ASKED_KEYS]
    alive = _keys("alive")
    everything = [*heard, *asked, *alive]
    rules = [
        _rule("hear", "ingress", ["declare_subscriber"], heard),
        _rule("hear-alive", "ingress", ["declare_liveliness_subscriber", "liveliness_query"], [*alive, *heard]),
        _rule("ask", "ingress", ["query"], asked),
        _rule("tell", "egress", ["put", "reply", "liveliness_token", "declare_queryable"], everything),
        _rule("calibrate", "ingress", ["query", "put"], [*_CALIBRATE]),
        _rule("calibrated", "egress", ["reply", "declare_queryable", "declare_subscriber"], [*_CALIBRATE]),
        _rule("publish", "ingress", ["put", "reply", "liveliness_token", "declare_queryable"], everything),
        _rule(
            "take", "egress", ["declare_subscriber", "query", "declare_liveliness_subscriber", "liveliness_query"], everything
        ),
        _rule("serve-calibration", "ingress", ["reply", "declare_queryable", "declare_subscriber"], [*_CALIBRATE]),
        _rule("pass-calibration", "egress", ["query", "put"], [*_CALIBRATE]),
    ]
    reading = ["hear", "hear-alive", "ask", "tell"]
    calibrating = [*reading, "calibrate", "calibrated"]
    publishing = ["publish", "take", "serve-calibration", "pass-calibration"]
    granted = {Role.THERAPY: reading, Role.OPERATOR: calibrating, Role.ROUTER: calibrating, Role.STATION: publishing}
    named = {role: access.of(role) for role in granted if access.of(role)}
    subjects: list[dict[str, Any]] = [{"id": str(role), "cert_common_names": names} for role, names in named.items()]
    policies = [{"subjects": [str(role)], "rules": granted[role]} for role in named]
    if gateway:
        subjects.append({"id": "local-station", "link_protocols": ["tcp"]})
        policies.append({"subjects": ["local-station"], "rules": publishing})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    }


def only_this_side_publishes() -> dict[str, Any]:
    """Return Zenoh's `access_control` for a station on its own machine, where nobody has an identity.

    Whoever is connected may subscribe and ask. Nobody may publish, answer or claim to be alive in the station's place: Zenoh
    would pass it on to the other programs connected here, and by the gateway to the network.
    """
    forging = {
        "id": "forge",
        "permission": "deny",
        "flows": ["ingress"],
        "messages": ["put", "delete", "reply", "declare_queryable", "liveliness_token"],
        "key_exprs": ["**"],
    }
    return {
        "enabled": True,
        "default_permission": "allow",
        "rules": [forging],
        "subjects": [{"id": "everybody"}],
        "policies": [{"subjects": ["everybody"], "rules": ["forge"]}],
    }


def access_to_json(access: AccessList) -> bytes:
    """Return an access list as the text of its file."""
    return (json.dumps(access.model_dump(mode="json"), indent=2) + "\n").encode()


def _keys(*tails: str) -> list[str]:
    return [f"ghest/*/{tail}" for tail in tails]


def _rule(name: str, flow: str, messages: list[str], keys: list[str]) -> dict[str, Any]:
    return {"id": name, "permission": "allow", "flows": [flow], "messages": messages, "key_exprs": keys}
