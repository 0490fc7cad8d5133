"""How pictures of scenes in space show the axes of joints and tools."""

AXIS_LENGTH, TOOL_LENGTH = 0.07, 0.09  # of the robot's size: how far from a joint its axes reach, axes of tools
TOOL_COLORS = ("#D55E00", "#009E73", "#0072B2")  # of x, y, z
