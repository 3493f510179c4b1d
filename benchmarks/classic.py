"""Every model fitted to the same materials: results/classic.json, docs/classic-comparison.md and its figures. Some five
minutes on two cores; `benchmarks/classic.py page` writes page and plot again from the results."""

import os
import sys

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # for small matrices threads only wait for each other

from lobe.lab import classic_page  # noqa: E402

if __name__ == "__main__":
    classic_page.main(measured=sys.argv[1:] == ["page"])
