"""Pictures of results: figures, the report, 3D views."""
