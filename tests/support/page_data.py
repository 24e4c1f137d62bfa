"""Numbers as pages hold them."""

import base64

import numpy as np
from numpy.typing import NDArray


def floats(text: str) -> NDArray[np.float32]:
    """The values of an encoded array."""
    return np.frombuffer(base64.b64decode(text), dtype="<f4")
