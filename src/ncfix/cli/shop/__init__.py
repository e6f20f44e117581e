"""Batches, watched folders and project files."""
