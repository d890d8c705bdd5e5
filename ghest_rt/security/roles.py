"""Roles of the clinic, and the names under which their holders appear in certificates and access lists."""

import re
from enum import StrEnum

from ghest_rt.errors import BadInputError

_NAME = re.compile(r"[a-z0-9][a-z0-9-]{0,39}")


class Role(StrEnum):
    """What the holder of a certificate may do.

    | role | may |
    |---|---|
    | station | publish, answer queries |
    | therapy | subscribe, query |
    | operator | as therapy, and calibrate |
    | router | pass messages on between the others |
    """

    STATION = "station"
    THERAPY = "therapy"
    OPERATOR = "operator"
    ROUTER = "router"


SERVER_ROLES = frozenset({Role.STATION, Role.ROUTER})
"""Roles that others connect to: only their certificates are good for a server."""


def common_name(role: Role, name: str) -> str:
    """Return the common name (CN) of a certificate: `therapy.game-1`.

    Raises:
        BadInputError: The name could not be told from others, or is no plain name of a machine or a function.
    """
    if not _NAME.fullmatch(name):
        raise BadInputError(
            f"{name!r}: a name is 1 to 40 lower-case letters, digits and hyphens, beginning with a letter or digit; "
            "name the machine or the function (bed-1, game-pc), not a person"
        )
    return f"{role}.{name}"


def parse_common_name(text: str) -> tuple[Role, str]:
    """Return role and name of a common name.

    Raises:
        BadInputError: It is not one of `ghest-rt certs`.
    """
    role_text, _, name = text.partition(".")
    if role_text not in set(Role) or not _NAME.fullmatch(name):
        raise BadInputError(f"common name {text!r} is not one of ghest-rt (role.name, for example therapy.game-1)")
    return Role(role_text), name
