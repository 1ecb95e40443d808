"""From a design to parts: actuators out of catalogues, tubes out of stock, and what that costs."""

BILL = "parts.csv"
CUTS = "cuts.csv"
RECORD = "build.json"
"""Files of a build in its run folder: the bill of materials, the cut list, and what it was made of."""
