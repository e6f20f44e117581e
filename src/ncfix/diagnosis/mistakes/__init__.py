"""Mistakes of set-up and software, as hypotheses beside missing effects."""
