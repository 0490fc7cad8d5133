"""Linear models, controllers and placement."""
