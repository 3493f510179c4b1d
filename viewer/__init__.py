"""The window: see the lobe, the truth, and the difference."""
