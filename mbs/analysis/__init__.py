"""The analyses of a scene, one file for each kind."""
