"""Where the library's files lie: beside `lab`, in a checkout and in the installed package alike."""

import os
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
GLSL = ROOT / "glsl"
DATA = ROOT / "data"


def cache() -> Path:
    """Folder for what can be fetched or computed again: LOBE_CACHE, or the user's cache."""
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(os.environ.get("LOBE_CACHE") or Path(home) / "lobe")
