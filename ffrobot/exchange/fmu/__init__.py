"""Functional mock-up units (FMI 2.0)."""
