"""Cycles of SINUMERIK: drilling, patterns of holes, milling, contours."""
