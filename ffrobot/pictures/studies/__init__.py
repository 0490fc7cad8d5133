"""What sensitivities, searches and uncertainties have found, as pictures: their data, figures, and files."""
