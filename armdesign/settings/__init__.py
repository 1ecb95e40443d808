"""Settings: what can be set, its default, range and meaning, declared once.

settings = Settings(design=Design(dof=4), search=Search(budget=10_000))
"""

from armdesign.settings.sections import (
    Body,
    Cell,
    Design,
    Fitness,
    Needs,
    Search,
    Settings,
    Solver,
    Task,
    read_settings,
)

__all__ = ["Body", "Cell", "Design", "Fitness", "Needs", "Search", "Settings", "Solver", "Task", "read_settings"]
