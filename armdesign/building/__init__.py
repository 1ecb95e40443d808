"""From a design to parts: actuators out of catalogues, tubes out of stock, and what that costs."""
