"""Mean FLIP of two linear pictures, which come as arrays on stdin: python -m lobe.viewer.flip.

A process of its own, since the library that computes it holds Python's lock for as long as it takes.
"""

import sys
from io import BytesIO

import numpy as np

from ..lab import compare
from .truth import low_priority

if __name__ == "__main__":
    low_priority()
    packed = BytesIO(sys.stdin.buffer.read())
    print(compare.flip(np.load(packed), np.load(packed)))
