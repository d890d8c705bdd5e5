"""Sessions of the service (see `ghest_rt.security.session`)."""

from ghest_rt.security.session import open_session

__all__ = ["open_session"]
