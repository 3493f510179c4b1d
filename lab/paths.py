"""Where the library's files lie: beside `lab`, in a checkout and in the installed package alike."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
GLSL = ROOT / "glsl"
DATA = ROOT / "data"
