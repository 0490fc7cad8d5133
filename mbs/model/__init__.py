"""The model of a scene: bodies, measures between markers, transmissions, the system that the core evaluates."""
