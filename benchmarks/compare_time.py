"""What `lobe compare` costs and finds: 512 x 512, two scenes, both contexts. Its errors stand in the README's table."""

import datetime
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

RESULT = Path(__file__).resolve().parent / "results" / "compare.json"
SCENES = ("teapot-directional", "suzanne-four")
COMMAND = ["compare", "--size", "512", "--context", "all", *(word for scene in SCENES for word in ("--scene", scene))]


def main():
    with tempfile.TemporaryDirectory() as folder:
        started = time.perf_counter()
        command = [sys.executable, "-m", "lobe.lab", *COMMAND, "--out", folder, "--json", f"{folder}/rows.json"]
        status = subprocess.run(command, stdout=subprocess.DEVNULL).returncode
        seconds = time.perf_counter() - started
        rows = json.loads(Path(folder, "rows.json").read_text())["results"]
    worst = {}
    for row in rows:
        known = worst.setdefault(row["function"], {"max_units": 0.0, "units_allowed": row["units_allowed"], "values": 0})
        known["values"] += row["pixels"]
        if row["mode"] != "frame":
            known["max_units"] = max(known["max_units"], row["max_units"])
    result = {
        "date": datetime.date.today().isoformat(),
        "command": "lobe " + " ".join(COMMAND),
        "seconds": round(seconds, 1),
        "cores": os.cpu_count(),
        "renderers": sorted({f"{row['context']}: {row['renderer']}" for row in rows}),
        "passed": status == 0,
        "functions": worst,
    }
    RESULT.write_text(json.dumps(result, indent=1) + "\n")
    print(f"{len(rows)} comparisons of {len(worst)} functions in {seconds:.1f} s, {'passed' if status == 0 else 'FAILED'}")


if __name__ == "__main__":
    main()
