"""Make the recordings of this folder anew, or the full-length movements of the paper.

    python sim_fixtures/generate.py                   the shipped excerpts and manifest.json
    python sim_fixtures/generate.py --full --out DIR  the four movements at full length (Table 2), 70 MB

The same seed gives the same bytes on the same kind of processor and library versions; elsewhere the last bits of the inverse
kinematics may differ. Needs the extra `sim`.
"""

import argparse
import hashlib
import json
import shlex
import subprocess
import sys
from pathlib import Path

_HERE = Path(__file__).resolve().parent
_SEED = 1
_EXCERPT_S = {"SAbAd": 5.0, "SFE": 5.0, "SIR": 5.0, "COMB": 8.0}


def command(movement: str, duration_s: float | None, out: Path) -> list[str]:
    """Return the command line that makes one recording."""
    words = ["ghest-rt", "simulate", "--movement", movement, "--sensor", "paper", "--seed", str(_SEED)]
    if duration_s is not None:
        words += ["--duration", f"{duration_s:g}"]
    return [*words, "--out", str(out)]


def main() -> None:
    """Run `ghest-rt simulate` for each movement; write the manifest beside the excerpts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true", help="full length instead of the excerpts")
    parser.add_argument("--out", type=Path, help="folder to write to (default: this one)")
    arguments = parser.parse_args()
    if arguments.full and arguments.out is None:
        parser.error("--full needs --out: the full-length recordings do not belong into this folder")
    out: Path = arguments.out or _HERE
    out.mkdir(parents=True, exist_ok=True)
    entries = []
    for movement, excerpt_s in _EXCERPT_S.items():
        path = out / f"{movement}.mcap"
        words = command(movement, None if arguments.full else excerpt_s, path)
        subprocess.run([str(Path(sys.executable).with_name(words[0])), *words[1:]], check=True)
        shown = shlex.join([*words[:-1], path.name])
        entries.append({"file": path.name, "command": shown, "sha256": hashlib.sha256(path.read_bytes()).hexdigest()})
    (out / "manifest.json").write_text(json.dumps({"recordings": entries}, indent=2) + "\n")


if __name__ == "__main__":
    main()
