"""The records of a scene file, and loading them."""
