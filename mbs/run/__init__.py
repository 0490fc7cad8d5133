"""Runs over time: what they start from, what integrates them, what they record, replays of them."""
