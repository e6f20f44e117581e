"""Batches of programs: finding them, working on them in parallel, recording results, resuming after a stop."""
