"""Recorded and planned motions of joints: what makes a robot vibrate that follows them, and motions that leave none."""
