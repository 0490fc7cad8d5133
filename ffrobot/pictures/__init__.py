"""Pictures of results: figures, the report, views in space."""
