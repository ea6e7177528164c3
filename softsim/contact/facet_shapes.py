"""Shape of one facet, an edge of a section or a triangle in space: closest point, normal.

A facet is given by the rows of X (d, d), the positions of its corners. A point x beside it is x =
sum_c W_c X_c + z n with the weights W of its projection onto the facet's line or plane, some of
them negative where the projection lies outside; the closest point of the facet has weights w >= 0.
"""

import taichi as ti

from softsim import backend


@ti.func
def corner(X, k):
    """Return row k of X."""
    return ti.Vector([X[k, j] for j in ti.static(range(X.m))])


@ti.func
def centroid(X):
    """Return the mean of the rows of X."""
    centre = corner(X, 0)
    for c in ti.static(range(1, X.n)):
        centre += corner(X, c)
    return centre / ti.static(float(X.n))


@ti.func
def foot_weights(X, gradients, x):
    """Return the weights W (d,): linear in x, each 1 at its own corner and 0 at the others."""
    W = gradients @ (x - corner(X, 0))
    W[0] += 1.0
    return W


@ti.func
def is_farther(X, x, square):
    """Return True only if no point of a facet is closer to x than the root of `square` [m^2].

    All its points lie within r, the distance of its farthest corner, of its centroid c, and (r +
    d)^2 <= 2 (r^2 + d^2), so |x - c|^2 > 2 (r^2 + d^2) is sufficient and needs no square root. This
    rejects most facets that are near but not the closest.
    """
    centre = centroid(X)
    farthest = ti.cast(0.0, backend.real)
    for c in ti.static(range(X.n)):
        farthest = ti.max(farthest, (corner(X, c) - centre).norm_sqr())
    return (x - centre).norm_sqr() > 2.0 * (farthest + square)


@ti.func
def velocity_beside(V, gradients, n, W, z):
    """Return the velocity [m/s] of the point W, z beside a facet, moving and turning with it.

    With the corner velocities V (rows) it is sum_c W_c v_c + z dn/dt, with dn/dt = -sum_c dW_c/dx
    (n . v_c).
    """
    return V.transpose() @ W - z * (gradients.transpose() @ (V @ n))


@ti.func
def corner_forces(gradients, n, W, z, T):
    """Return the corner forces (rows) of a facet for a force T at the point W, z beside it.

    They have the same power, so the same resultant and moment.
    """
    return W.outer_product(T) - z * (gradients @ T).outer_product(n)


@ti.func
def share_along(a, b, x):
    """Return the position of the point of the line from a to b closest to x: 0 at a, 1 at b."""
    along = b - a
    return ti.math.clamp((x - a).dot(along) / along.norm_sqr(), 0.0, 1.0)


class Edge:
    """An edge of a section, with the material to its left."""

    dimension = 2

    @ti.func
    def area_vector(self, X):
        """Return the normal out of the material, with the length of the edge [m]."""
        along = corner(X, 1) - corner(X, 0)
        return ti.Vector([along[1], -along[0]])

    @ti.func
    def normal(self, X):
        """Return the unit normal out of the material."""
        return self.area_vector(X).normalized()

    @ti.func
    def weight_gradients(self, X):
        """Return dW_c/dx, one row for each corner [1/m]."""
        along = corner(X, 1) - corner(X, 0)
        g = along / along.norm_sqr()
        return ti.Matrix([[-g[0], -g[1]], [g[0], g[1]]])

    @ti.func
    def closest_weights(self, X, x):
        """Return the weights w of the point of the edge closest to x."""
        t = share_along(corner(X, 0), corner(X, 1), x)
        return ti.Vector([1.0 - t, t])

    @ti.func
    def angle(self, X, k):
        """Return 1, the weight of an edge's normal in the surface normal at a corner."""
        return ti.cast(1.0, backend.real)


class Triangle:
    """A triangle in space; seen from outside its corners go counter-clockwise."""

    dimension = 3

    @ti.func
    def area_vector(self, X):
        """Return the normal out of the material, with the length of twice the area [m^2]."""
        a = corner(X, 0)
        return (corner(X, 1) - a).cross(corner(X, 2) - a)

    @ti.func
    def normal(self, X):
        """Return the unit normal out of the material."""
        return self.area_vector(X).normalized()

    @ti.func
    def weight_gradients(self, X):
        """Return dW_c/dx, one row for each corner [1/m]."""
        a = corner(X, 0)
        e, f = corner(X, 1) - a, corner(X, 2) - a
        area = e.cross(f)
        g1, g2 = f.cross(area) / area.norm_sqr(), area.cross(e) / area.norm_sqr()
        g0 = -g1 - g2
        return ti.Matrix([[g0[0], g0[1], g0[2]], [g1[0], g1[1], g1[2]], [g2[0], g2[1], g2[2]]])

    @ti.func
    def closest_weights(self, X, x):
        """Return the weights w of the point of the triangle closest to x, inside or on a side."""
        w = foot_weights(X, self.weight_gradients(X), x)
        if w.min() < 0.0:
            nearest = ti.cast(1e30, backend.real)
            for k in ti.static(range(3)):
                i, j = ti.static(k, (k + 1) % 3)
                a, b = corner(X, i), corner(X, j)
                t = share_along(a, b, x)
                square = (x - a - t * (b - a)).norm_sqr()
                if square < nearest:
                    nearest = square
                    w = ti.Vector([0.0, 0.0, 0.0])
                    w[i], w[j] = 1.0 - t, t
        return w

    @ti.func
    def angle(self, X, k):
        """Return the angle [rad] at corner k, the weight of the normal in the surface normal."""
        e, f = corner(X, (k + 1) % 3) - corner(X, k), corner(X, (k + 2) % 3) - corner(X, k)
        return ti.atan2(e.cross(f).norm(), e.dot(f))
