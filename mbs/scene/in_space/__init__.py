"""Planar scenes as scenes in space: the same robot in the plane z = 0, every joint about z."""
