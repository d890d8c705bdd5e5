"""What one sees while the service runs: a live page on a terminal, a line a second elsewhere."""

import logging
import math
from collections import deque
from dataclasses import dataclass
from types import TracebackType
from typing import Self

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from ghest_rt.cli.scoreboard import Scoreboard
from ghest_rt.messages.published import Event, GhAngles, Health, InputState
from ghest_rt.messages.results import GhEstimate, Reason, Status

_log = logging.getLogger(__name__)

_REFRESH_HZ = 6  # drawing takes the interpreter from the vision threads
_GAUGE_RANGE_DEG = 120.0
_GAUGE_HALF = 24
_STATUS_STYLE = {Status.VALID: "bold green", Status.DEGRADED: "bold yellow", Status.LOST: "bold red"}
_STATE_STYLE = {InputState.STREAMING: "green", InputState.ENDED: "dim"}


@dataclass(slots=True)
class LiveFacts:
    """What heads the page.

    Attributes:
        title: Station and source.
        method: Estimation method.
        endpoints: Where Zenoh listens; empty without publishing.
        key: The key of the angles.
    """

    title: str
    method: str
    endpoints: tuple[str, ...]
    key: str


class LiveView:
    """An output of the service that shows itself; drawn on a thread of its own, never in a tick."""

    def __init__(self, console: Console, facts: LiveFacts, scoreboard: Scoreboard, level: int = logging.INFO) -> None:
        """Prepare.

        Args:
            console: Where to.
            facts: What heads the page.
            scoreboard: Errors against the truth, if there is one.
            level: Of the lines logged where the console is no terminal.
        """
        self._level = level
        self._console = console
        self._facts = facts
        self._scoreboard = scoreboard
        self._message: GhAngles | None = None
        self._health: Health | None = None
        self._events: deque[Event] = deque(maxlen=4)
        self._live = (
            Live(console=console, get_renderable=self._page, refresh_per_second=_REFRESH_HZ) if console.is_terminal else None
        )

    def __enter__(self) -> Self:
        if self._live is not None:
            self._live.start(refresh=True)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self._live is not None:
            self._live.stop()

    def angles(self, message: GhAngles, estimate: GhEstimate) -> None:
        """Keep the newest sample for the next drawing."""
        self._message = message

    def health(self, message: Health) -> None:
        """Keep the newest state; without a terminal, log it."""
        self._health = message
        if self._live is None:
            _log.log(self._level, "%s", self._line(message))

    def event(self, message: Event) -> None:
        """Keep the newest events."""
        self._events.append(message)

    def _line(self, health: Health) -> str:
        angles = self._message.angles_deg if self._message is not None else None
        shown = (
            f"flexion {angles.flexion:7.2f}  abduction {angles.abduction:7.2f}  rotation {angles.rotation:7.2f} deg"
            if angles is not None
            else f"no angles ({health.reason})"
        )
        error = (
            f"  error {self._scoreboard.orientation_rmse_deg:.3f} deg {self._scoreboard.position_rmse_mm:.3f} mm rms"
            if self._scoreboard.judged
            else ""
        )
        late = health.lateness
        return (
            f"{health.status:8s} {shown}  {health.rate_hz:6.2f} Hz  late p99 {late.p99_us / 1000:.2f} ms  "
            f"missed {health.missed_ticks}{error}"
        )

    def _page(self) -> Panel:
        facts = self._facts
        where = f"[bold]{facts.key}[/] on {', '.join(facts.endpoints)}" if facts.endpoints else "not published"
        parts: list[RenderableType] = [self._angles_table(), self._inputs_table(), self._timing()]
        if self._scoreboard.judged:
            board = self._scoreboard
            parts.append(
                Text(
                    f"against the truth: now {board.newest_orientation_deg:.3f}° {board.newest_position_mm:.3f} mm · "
                    f"rms {board.orientation_rmse_deg:.3f}° {board.position_rmse_mm:.3f} mm over {board.judged} samples",
                    style="cyan",
                )
            )
        parts.extend(
            Text(f"{event.source}: {event.kind.replace('_', ' ')}: {event.message}", style="dim")
            for event in list(self._events)
        )
        return Panel(Group(*parts), title=f"ghest-rt · {facts.title} · {facts.method}", subtitle=where, title_align="left")

    def _angles_table(self) -> Table:
        table = Table.grid(padding=(0, 2))
        message = self._message
        if message is None:
            table.add_row(Text("waiting for the first sample", style="dim"))
            return table
        reason = "" if message.reason is Reason.NONE else f" ({message.reason})"
        table.add_row(Text(f"{message.status}{reason}", style=_STATUS_STYLE[message.status]), f"sample {message.seq}")
        for name in ("flexion", "abduction", "rotation"):
            value = getattr(message.angles_deg, name) if message.angles_deg is not None else math.nan
            sigma = getattr(message.sigma_deg, name) if message.sigma_deg is not None else math.nan
            shown = "   –   " if math.isnan(value) else f"{value:8.2f}°"
            spread = "" if math.isnan(sigma) else f"± {sigma:.2f}°"
            table.add_row(name, shown, spread, Text(gauge(value), style="cyan"))
        return table

    def _inputs_table(self) -> Table:
        table = Table(box=None, header_style="dim", padding=(0, 2, 0, 0))
        for column in ("input", "state", "rate", "received", "missing", "skipped", "bad", "age"):
            table.add_column(column, justify="left" if column in {"input", "state"} else "right")
        ages = self._message.age_ms if self._message is not None else {}
        for name, item in (self._health.inputs if self._health is not None else {}).items():
            age_ms = ages.get(name)
            table.add_row(
                name,
                Text(item.state, style=_STATE_STYLE.get(item.state, "red")),
                f"{item.rate_hz:.1f} Hz",
                str(item.received),
                str(item.missing),
                str(item.skipped),
                str(item.bad),
                "–" if age_ms is None else f"{age_ms:.0f} ms",
            )
        return table

    def _timing(self) -> Text:
        health = self._health
        if health is None:
            return Text("")
        late = health.lateness
        return Text(
            f"{health.rate_hz:.2f} Hz · late p50 {late.p50_us / 1000:.2f} p99 {late.p99_us / 1000:.2f} "
            f"max {late.max_us / 1000:.2f} ms · missed {health.missed_ticks} · CPU {health.cpu_percent:.0f} % · "
            f"{health.memory_mb:.0f} MB"
        )


def gauge(value_deg: float) -> str:
    """Return a bar from the middle (0°) to the value; empty for NaN."""
    filled = 0 if math.isnan(value_deg) else round(min(abs(value_deg) / _GAUGE_RANGE_DEG, 1.0) * _GAUGE_HALF)
    left = "█" * filled if value_deg < 0 else ""
    right = "█" * filled if value_deg > 0 else ""
    return f"{left:·>{_GAUGE_HALF}}│{right:·<{_GAUGE_HALF}}"
