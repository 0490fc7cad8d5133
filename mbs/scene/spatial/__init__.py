"""The records of a scene in space, beside those of the plane."""
