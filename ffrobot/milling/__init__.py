"""Stability of milling with a robot: chatter-free depths of cut over pose, feed direction and spindle speed."""
