"""SINUMERIK 840D: its blocks, what they mean, and how corrected motions are put into them."""
