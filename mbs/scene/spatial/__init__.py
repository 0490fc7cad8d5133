"""The records of a scene; planar scenes are read by the same."""
