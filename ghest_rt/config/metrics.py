"""Where the metrics endpoint listens."""

import ipaddress
import re
from typing import NamedTuple

from pydantic import Field, model_validator

from ghest_rt.config.strict import Strict

_ADDRESS = re.compile(r"^(?P<host>\[[0-9a-fA-F:.]+\]|[^\[\]:]+):(?P<port>\d{1,5})$")


class Address(NamedTuple):
    """A host and a port."""

    host: str
    port: int


class Metrics(Strict):
    """A text endpoint for Prometheus (needs the extra `metrics`); off unless it is told where to listen."""

    listen: str | None = Field(default=None, description='host:port, for example "127.0.0.1:9464"; port 0 takes any free one')
    beyond_loopback: bool = Field(
        default=False, description="Allow an address that other machines can reach; there is neither encryption nor a password"
    )

    @property
    def address(self) -> Address | None:
        """`listen`, taken apart; None if there shall be no endpoint."""
        match = None if self.listen is None else _ADDRESS.match(self.listen)
        return None if match is None else Address(match["host"].strip("[]"), int(match["port"]))

    @model_validator(mode="after")
    def _listens_where_it_may(self) -> "Metrics":
        if self.listen is None:
            return self
        address = self.address
        if address is None or address.port > 65535:
            raise ValueError('listen must be host:port, for example "127.0.0.1:9464"')
        if not self.beyond_loopback and not _is_loopback(address.host):
            raise ValueError(
                f"listen: other machines can reach {address.host}, and the endpoint has neither encryption nor a password; "
                "take 127.0.0.1, or say beyond_loopback = true"
            )
        return self


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
