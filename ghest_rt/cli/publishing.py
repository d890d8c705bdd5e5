"""One Zenoh session for a whole command, and the publisher of whichever station is running."""

from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Self

import zenoh

from ghest_rt.config.station import Publisher, StationConfig
from ghest_rt.security.identity import use_identity
from ghest_rt.security.session import open_session
from ghest_rt.service.publisher import ZenohPublisher


class Publishing:
    """Opens the session when entered; without publishing it does nothing."""

    def __init__(self, settings: Publisher, listen: str | None, wanted: bool, lossless: bool, folder: Path = Path()) -> None:
        """Prepare.

        Args:
            settings: From the station file.
            listen: Overrides the endpoints to listen on.
            wanted: False if the command line says not to publish.
            lossless: Wait for slow subscribers instead of dropping messages for them.
            folder: Of the station file, which the settings' identity is relative to.
        """
        self.endpoints: tuple[str, ...] = ()
        self._listen = settings.listen if listen is None else (listen,)
        self._connect = settings.connect
        self._identity = None if settings.identity is None else folder / settings.identity
        self._wanted = wanted and settings.enabled
        self._lossless = lossless
        self._stack = ExitStack()
        self._session: zenoh.Session | None = None
        self._publisher: ZenohPublisher | None = None
        self._config: StationConfig | None = None

    def __enter__(self) -> Self:
        if self._wanted:
            identity = None if self._identity is None else use_identity(self._identity)
            session, self.endpoints = open_session(self._listen, self._connect, identity)
            self._session = self._stack.enter_context(session)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self._publisher is not None:
            self._publisher.close()
        self._stack.close()

    def publisher_for(self, config: StationConfig) -> ZenohPublisher | None:
        """Return the publisher of this station, the same as long as the station is; None without publishing."""
        if self._session is None:
            return None
        if self._publisher is None or config != self._config:
            if self._publisher is not None:
                self._publisher.close()
            self._publisher, self._config = ZenohPublisher(self._session, config, self._lossless), config
        return self._publisher
