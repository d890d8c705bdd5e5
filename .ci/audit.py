"""Known vulnerabilities of what is installed, and the bill of materials (SBOM): `python .ci/audit.py build/sbom.json`.

Needs the extra `audit`. `pip-audit` calls an environment clean when its service knew none of the packages; here, what could
not be looked up is said to be so, and never counts as passed.
"""

import json
import subprocess
import sys
from pathlib import Path

_TIMEOUT_S = 300


def main() -> int:
    """Write the SBOM, audit, and return 1 if something installed is known to be vulnerable."""
    sbom = Path(sys.argv[1])
    sbom.parent.mkdir(parents=True, exist_ok=True)
    command = ["cyclonedx_py", "environment", "--pyproject", "pyproject.toml", "--output-reproducible", "--validate"]
    subprocess.run([sys.executable, "-m", *command, "--output-file", str(sbom)], check=True)
    print(f"SBOM: {len(json.loads(sbom.read_text())['components'])} components in {sbom}")
    findings = audit("pypi") or audit("osv")
    if findings is None:
        print("AUDIT: NOT DONE: no vulnerability service can be reached from here. This says nothing about vulnerabilities.")
        return 0
    known = [f"{name}: {ids}" for name, ids in findings.items() if ids]
    print(f"AUDIT: {len(findings)} packages looked up, {len(known)} with known vulnerabilities")
    print("\n".join(known))
    return 1 if known else 0


def audit(service: str) -> dict[str, str] | None:
    """Return the known vulnerabilities of every package that the service knows; None if it cannot be reached, or knows none."""
    command = [
        sys.executable,
        "-m",
        "pip_audit",
        "--format",
        "json",
        "--progress-spinner",
        "off",
        "--vulnerability-service",
        service,
    ]
    try:
        ended = subprocess.run(command, capture_output=True, text=True, timeout=_TIMEOUT_S, check=False)
        dependencies = json.loads(ended.stdout)["dependencies"]
    except (subprocess.TimeoutExpired, json.JSONDecodeError) as error:
        print(f"audit with {service}: {type(error).__name__}")
        return None
    skipped = [entry["name"] for entry in dependencies if "skip_reason" in entry]
    if skipped:
        print(f"audit with {service}: {len(skipped)} of {len(dependencies)} packages could not be looked up")
    found = {
        f"{entry['name']} {entry['version']}": ", ".join(vulnerability["id"] for vulnerability in entry["vulns"])
        for entry in dependencies
        if "vulns" in entry
    }
    return found or None


if __name__ == "__main__":
    sys.exit(main())
