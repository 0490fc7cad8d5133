"""URDF robot descriptions: read, checked, and written as scenes in space."""
