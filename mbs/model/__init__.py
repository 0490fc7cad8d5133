"""The model of a scene: bodies, joints, constraint equations, gears, and the system that the core evaluates."""
