"""Numbers of summaries and pages without what is only round-off."""

ROUND_OFF = 1e-9  # m, N·m, rad/s, W: numbers below it are rounding


def number(value: float) -> str:
    """Four digits; 0 of round-off."""
    return f"{value if value > ROUND_OFF else 0:.4g}"


def millimeters(value: float, digits: int = 4) -> str:
    """A length `value` in m as text in mm."""
    return f"{1e3 * value:.{digits}g} mm" if value >= ROUND_OFF else f"< {1e3 * ROUND_OFF:g} mm"
