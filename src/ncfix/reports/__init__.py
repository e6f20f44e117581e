"""Results as pages and plots; nothing is computed here."""
