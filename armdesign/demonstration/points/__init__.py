"""Which points of a recording make the arm: by expression, by name, by guess."""
