"""The language of SINUMERIK 840D: parsing, following and rewriting of programs."""
