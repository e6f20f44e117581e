"""What all families of controls share while a program is followed: state, motions, and what is known of them.

A family adds its words and codes to it, and never looks into another; only the Fanuc family builds on RS274.
"""
