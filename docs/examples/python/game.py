"""The loop of a therapy game: 60 pictures a second, each with the angles of this moment or with none.

`python game.py [ENDPOINT]`
"""

import sys
import time

from ghest_rt.client import GhestClient


def draw(text: str) -> None:
    """Stand in for a picture."""
    sys.stdout.write(f"\r{text:60s}")
    sys.stdout.flush()


def play(endpoint: str, pictures: int) -> None:
    """Play for some pictures."""
    with GhestClient(endpoint) as client:
        for _ in range(pictures):
            sample = client.latest(max_age_s=0.2)
            link = client.link()
            if sample is None:
                draw("pause: no station" if link is None else f"pause: {link.state} ({link.cause})")
            elif (angles := sample.message.angles_deg) is None:
                draw(f"pause: {sample.message.reason}")
            else:
                draw(f"flexion {angles.flexion:7.2f}°  abduction {angles.abduction:7.2f}°  rotation {angles.rotation:7.2f}°")
            time.sleep(1 / 60)


if __name__ == "__main__":
    play(sys.argv[1] if len(sys.argv) > 1 else "tcp/127.0.0.1:7447", 60 * 60)
