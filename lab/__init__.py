"""The bench of Lobe."""
