"""Speed against accuracy, of ours and other libraries': results/chart.json, docs/findings.md, README's chart, column.

On a machine with a GPU, `benchmarks/chart.py gpu` times the same there, and writes results/chart-gpu.json beside;
docs/findings.md then tells of it.
"""

import subprocess
import sys
from pathlib import Path

RESULTS = Path(__file__).resolve().parent / "results"
OUT = Path(__file__).resolve().parents[1] / "out" / "chart"


def main(device: str, result: Path) -> int:
    command = ["chart", "--device", device, "--peers", "--out", OUT, "--json", result]
    status = subprocess.run([sys.executable, "-m", "lobe.lab", *command]).returncode
    if status == 0:
        for module in ("findings", "readme"):
            subprocess.run([sys.executable, "-m", f"lobe.lab.{module}"], check=True)
    return status


if __name__ == "__main__":
    sys.exit(main("gl", RESULTS / "chart-gpu.json") if sys.argv[1:] == ["gpu"] else main("all", RESULTS / "chart.json"))
