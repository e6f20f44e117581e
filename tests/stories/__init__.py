"""The worked stories of examples/stories, run as their READMEs tell them."""
