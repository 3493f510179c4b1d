"""What other libraries' functions cost and how wrong they are, beside ours: results/peers.json and docs/peers.md.

Fetches their packages into the user's cache where they are not there yet.
"""

import datetime
import json
import math
from pathlib import Path

from lobe.lab import findings, gl, isa, packages, peers, peers_measured, peers_page

RESULT = Path(__file__).resolve().parent / "results" / "peers.json"


def main():
    for package in peers.PACKAGES.values():
        packages.content(package)
    measured = peers_measured.measure()
    result = {
        "schema": 1,
        "date": datetime.date.today().isoformat(),
        "compiler": isa.toolchain(),
        "renderer": gl.create_context("egl").renderer,
        "packages": {name: {"version": p.version, "licence": p.licence, "home": p.home}
                     for name, p in peers.PACKAGES.items()},
        "results": measured,
    }
    rows = ",\n  ".join(json.dumps(_plain(row), allow_nan=False) for row in result.pop("results"))
    head = json.dumps(result, indent=1)[:-2]
    RESULT.write_text(f'{head},\n "results": [\n  {rows}\n ]\n}}\n')
    peers_page.main()
    findings.main()  # which tells who is right
    print(f"{len(measured)} functions, {len(peers_measured.ahead(measured))} peers ahead")


def _plain(value):
    """Floats to four digits; null where they are not finite."""
    if isinstance(value, dict):
        return {name: _plain(item) for name, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return float(f"{value:.4g}") if math.isfinite(value) else None
    return value


if __name__ == "__main__":
    main()
