"""Everything a station says, in order and complete, until Ctrl-C. `python log.py [ENDPOINT]`."""

import asyncio
import sys

from ghest_rt.client import EventReport, Gap, GhestClient, LinkChanged, Restarted, Sample


async def log(endpoint: str) -> None:
    """Write a line for every update."""
    async with GhestClient(endpoint) as client:
        async for update in client.updates():
            match update:
                case Sample(station, message):
                    angles = message.angles_deg
                    line = f"{station} {message.seq} {message.status} {'-' if angles is None else angles.flexion}"
                case Gap(station, _, first, last, cause):
                    line = f"{station} MISSING {first}..{last} ({cause})"
                case LinkChanged(station, state, cause):
                    line = f"{station} {state} ({cause})"
                case Restarted(station):
                    line = f"{station} was started anew"
                case EventReport(station, event):
                    line = f"{station} {event.severity}: {event.message}"
                case _:
                    continue
            sys.stdout.write(line + "\n")
            sys.stdout.flush()


if __name__ == "__main__":
    asyncio.run(log(sys.argv[1] if len(sys.argv) > 1 else "tcp/127.0.0.1:7447"))
