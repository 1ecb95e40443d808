"""The state of a NumPy generator as text, exact and without pickle."""

from __future__ import annotations

import json

import numpy as np

from armdesign.errors import SearchError, SettingsError

BIT_GENERATORS = ("PCG64", "PCG64DXSM", "MT19937", "Philox", "SFC64")


def encode(rng: np.random.Generator) -> str:
    """Write the state as JSON text.

    It is text, not numbers, because it holds integers of 128 bits, which few JSON readers keep.

    Raises:
        SettingsError: The generator is none of NumPy's own.
    """
    state = rng.bit_generator.state
    name = state.get("bit_generator")
    if name not in BIT_GENERATORS:
        raise SettingsError(f"the state of a '{name}' generator cannot be saved", value=name, allowed=BIT_GENERATORS)
    return json.dumps(state, default=lambda value: value.tolist())


def decode(text: object) -> np.random.Generator:
    """The generator whose state :func:`encode` wrote.

    Raises:
        SearchError: The text is not such a state.
    """
    try:
        state = json.loads(str(text))
        name = state["bit_generator"]
        if name not in BIT_GENERATORS:
            raise ValueError(f"unknown generator '{name}'")
        bits = getattr(np.random, name)(0)
        bits.state = state
    except (KeyError, TypeError, ValueError, OverflowError, IndexError) as error:
        message = f"the saved state of the random generator cannot be read ({error})"
        raise SearchError(message, value=text, fix="Start the search anew, or restore the saved state") from error
    return np.random.Generator(bits)
