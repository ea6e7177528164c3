"""Shape-function gradients of linear triangles."""

import numpy as np


def reference_gradients(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gradients of the shape functions (cells, 3, 2) [1/m] and signed areas (cells,) [m^2]."""
    corners = points[cells]
    d1 = corners[:, 1] - corners[:, 0]
    d2 = corners[:, 2] - corners[:, 0]
    double_area = d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]
    grad_1 = np.stack([d2[:, 1], -d2[:, 0]], axis=1) / double_area[:, None]
    grad_2 = np.stack([-d1[:, 1], d1[:, 0]], axis=1) / double_area[:, None]
    return np.stack([-grad_1 - grad_2, grad_1, grad_2], axis=1), 0.5 * double_area
