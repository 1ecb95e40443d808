"""Types that every room uses."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""An array of doubles; its shape and unit stand where it is used."""


class CallableRoom(ModuleType):
    """A package that can be called like its main function, where both have the one name in the API.

    ``armdesign.search.prepare`` is a module in the room, ``armdesign.search(problem)`` a search.

    Attributes:
        MAIN: Module and name of the function, imported when it is first called.
    """

    MAIN: tuple[str, str]

    @property
    def function(self) -> Callable[..., Any]:
        """The main function."""
        module, name = self.MAIN
        return getattr(import_module(module), name)  # type: ignore[no-any-return]

    @property
    def __signature__(self) -> inspect.Signature:
        return inspect.signature(self.function)

    def __call__(self, *values: Any, **options: Any) -> Any:  # noqa: ANN401 (whatever the function takes)
        """Call the main function."""
        return self.function(*values, **options)
