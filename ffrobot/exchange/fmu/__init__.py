"""Linear models as functional mock-up units (FMI 2.0)."""
