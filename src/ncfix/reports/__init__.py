"""Renders results as pages and plots; computes nothing."""
