"""Meshes of the links: what a finite element model stands on."""
