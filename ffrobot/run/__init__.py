"""Stage 2 from a scene to everything that is computed of it."""
