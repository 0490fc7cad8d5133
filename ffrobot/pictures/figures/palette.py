"""Colours that everyone can tell apart."""

# Okabe and Ito, "Color universal design" (2008), without the yellow that paper swallows, and a gray that
# is seen on light and dark pages for black.
COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#7A7A7A")
