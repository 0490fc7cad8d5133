"""Pictures of results of sensitivities, searches and uncertainties: their data, figures, and files."""
