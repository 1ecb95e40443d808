"""How many joints a task needs: searches of 2, 3, ... joints, each begun from the one before, until more do not pay."""
