"""Settings: what can be set, its default, range and meaning, declared once."""
