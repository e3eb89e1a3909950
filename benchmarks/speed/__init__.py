"""How fast objstate is, and whether its fast ways give what brute force gives."""
