"""URDF robot descriptions: read, checked, and written as 3D scenes."""
