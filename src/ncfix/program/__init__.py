"""NC programs: their text, its lossless tree, the motions that it means, and corrected motions back into text."""
