// The ceiling: softsim's bare explicit increment, written by hand for one processor.
//
//     reference INPUT THREADS INCREMENTS REPEATS [POSITIONS]
//
// INPUT is written by ceiling.py (layout: `read_problem` below). Prints rate and energies as JSON;
// writes the final positions to POSITIONS. Ends with 1 if energies are not finite. One increment is
//     x += dt v                                                            drift
//     J_a = sum V_e / sum V_e0,  p_a = kappa (J_a - 1) + b_a dJ_a/dt       averaged nodal pressure
//     A_k = e_k A_k + (1 - e_k) C_bar^-1(t - phi_k dt)                     Maxwell branches, every
//                                  n_k-th increment: softsim/elements/relaxation.py
//     S = J^(-2/3) (M - (C : M) / 3 C^-1) + p_e J C^-1,  M = 2 W' I + sum mu_k A_k     Yeoh's law
//     f_c = -V S_ck d_k,  T = V F_zz S_zz / D on diameters of rings        corner forces
//     v += dt (f / m + g)                                                  kick
// on plane-strain triangles, ring sections or tetrahedra, and on plane-strain quadrilaterals or
// hexahedra, which have a pressure of their own and springs on their hourglass modes: the equations
// of softsim/elements, with what branches and bulk viscosity dissipate; without contact, loads and
// rigid bodies.
//
// What made it fast (AVX-512, Zen 4):
// * Lanes: eight elements at a time, four with AVX2; corner data gathered whole nodes at a load.
// * No F: tensors in the basis of an element's edges d_c = x_c - x_0, in which C_ck = d_c . d_k and
//     f_c = -(J^(-2/3) sum_k V M_ck d_k + (p_e - J^(-2/3) (C : M) / (3 J)) dV/dx_c),
//   four numbers of reference geometry a triangle instead of five, seven a tetrahedron, not ten.
// * Branches keep -mu V A, and their sum, which the forces want.
// * No serial sums of forces into nodes, whose additions wait for one another (half the rate):
//   elements write their corners' shares side by side, nodes collect theirs. The nodes of one
//   slice collect in lock step; slices are sorted by how many elements a node has, and padded by
//   an empty slot, so no branch is mispredicted.
// * One sweep over the mesh does an increment. Nodes and elements lie in a band, so pressure,
//   stress and kick follow close behind the volumes that they wait for, in the cache.
// * Two threads: each sweeps its half towards the common interface, which is done between barriers.
//   Diameters of rings join far ends of the band: they are measured before the sweep, and pull
//   after it.
// * Huge pages.

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <thread>
#include <type_traits>
#include <vector>

#ifdef __AVX__
#include <immintrin.h>
#endif
#ifdef __linux__
#include <sys/mman.h>
#endif

// As many as a register holds: compilers take longer vectors apart by way of the stack.
#ifdef __AVX512F__
constexpr int LANES = 8;
#else
constexpr int LANES = 4;
#endif
using Pair = double __attribute__((vector_size(16)));
using Quad = double __attribute__((vector_size(32)));
using Lanes = double __attribute__((vector_size(8 * LANES)));

// --- lanes of vectors side by side ---------------------------------------------------------------

struct Plane {
    Lanes x, y;
};
struct Space {
    Lanes x, y, z;
};
// Member by member: compilers copy a whole struct by way of the stack.
inline Plane copied(const Plane& a) { return {a.x, a.y}; }
inline Space copied(const Space& a) { return {a.x, a.y, a.z}; }
inline Plane operator+(Plane a, Plane b) { return {a.x + b.x, a.y + b.y}; }
inline Space operator+(Space a, Space b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Plane operator-(Plane a, Plane b) { return {a.x - b.x, a.y - b.y}; }
inline Space operator-(Space a, Space b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Plane operator-(Plane a) { return {-a.x, -a.y}; }
inline Space operator-(Space a) { return {-a.x, -a.y, -a.z}; }
template <class S>
inline Plane operator*(S s, Plane a) {
    return {s * a.x, s * a.y};
}
template <class S>
inline Space operator*(S s, Space a) {
    return {s * a.x, s * a.y, s * a.z};
}
inline Lanes dot(Plane a, Plane b) { return a.x * b.x + a.y * b.y; }
inline Lanes dot(Space a, Space b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Space cross(Space a, Space b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// Compilers load both halves before they join them; the instruction joins while it loads.
inline Quad joined(Pair a, Pair b) {
#ifdef __AVX__
    return _mm256_insertf128_pd(_mm256_castpd128_pd256(a), b, 1);
#else
    return __builtin_shufflevector(a, b, 0, 1, 2, 3);
#endif
}

using Corner = std::array<int32_t, LANES>;  // the node at one corner of each lane's element

// `gather`: a vector of each lane's node. `store`: lanes one after the other, x y x y ... of a
// section, x y z 0 x y z 0 ... in space.
#ifdef __AVX512F__
inline Lanes joined(Quad a, Quad b) { return _mm512_insertf64x4(_mm512_castpd256_pd512(a), b, 1); }
inline Plane gather(const Pair* node, const Corner& c) {
    Lanes a = joined(joined(node[c[0]], node[c[2]]), joined(node[c[4]], node[c[6]]));
    Lanes b = joined(joined(node[c[1]], node[c[3]]), joined(node[c[5]], node[c[7]]));
    return {__builtin_shufflevector(a, b, 0, 8, 2, 10, 4, 12, 6, 14),
            __builtin_shufflevector(a, b, 1, 9, 3, 11, 5, 13, 7, 15)};
}
inline Space gather(const Quad* node, const Corner& c) {
    Lanes a = joined(node[c[0]], node[c[2]]), b = joined(node[c[1]], node[c[3]]);
    Lanes d = joined(node[c[4]], node[c[6]]), e = joined(node[c[5]], node[c[7]]);
    Lanes ab = __builtin_shufflevector(a, b, 0, 8, 2, 10, 4, 12, 6, 14);  // x z x z
    Lanes de = __builtin_shufflevector(d, e, 0, 8, 2, 10, 4, 12, 6, 14);
    Lanes ab_y = __builtin_shufflevector(a, b, 1, 9, 3, 11, 5, 13, 7, 15);
    Lanes de_y = __builtin_shufflevector(d, e, 1, 9, 3, 11, 5, 13, 7, 15);
    return {__builtin_shufflevector(ab, de, 0, 1, 4, 5, 8, 9, 12, 13),
            __builtin_shufflevector(ab_y, de_y, 0, 1, 4, 5, 8, 9, 12, 13),
            __builtin_shufflevector(ab, de, 2, 3, 6, 7, 10, 11, 14, 15)};
}
inline void store(Lanes* slot, Plane f) {
    slot[0] = __builtin_shufflevector(f.x, f.y, 0, 8, 1, 9, 2, 10, 3, 11);
    slot[1] = __builtin_shufflevector(f.x, f.y, 4, 12, 5, 13, 6, 14, 7, 15);
}
inline void store(Lanes* slot, Space f) {
    Lanes zero = {};
    Lanes xy0 = __builtin_shufflevector(f.x, f.y, 0, 8, 1, 9, 2, 10, 3, 11);
    Lanes xy1 = __builtin_shufflevector(f.x, f.y, 4, 12, 5, 13, 6, 14, 7, 15);
    Lanes z0 = __builtin_shufflevector(f.z, zero, 0, 8, 1, 9, 2, 10, 3, 11);
    Lanes z1 = __builtin_shufflevector(f.z, zero, 4, 12, 5, 13, 6, 14, 7, 15);
    slot[0] = __builtin_shufflevector(xy0, z0, 0, 1, 8, 9, 2, 3, 10, 11);
    slot[1] = __builtin_shufflevector(xy0, z0, 4, 5, 12, 13, 6, 7, 14, 15);
    slot[2] = __builtin_shufflevector(xy1, z1, 0, 1, 8, 9, 2, 3, 10, 11);
    slot[3] = __builtin_shufflevector(xy1, z1, 4, 5, 12, 13, 6, 7, 14, 15);
}
#else
inline Plane gather(const Pair* node, const Corner& c) {
    Lanes a = joined(node[c[0]], node[c[2]]), b = joined(node[c[1]], node[c[3]]);
    return {__builtin_shufflevector(a, b, 0, 4, 2, 6), __builtin_shufflevector(a, b, 1, 5, 3, 7)};
}
inline Space gather(const Quad* node, const Corner& c) {
    Quad a = node[c[0]], b = node[c[1]], d = node[c[2]], e = node[c[3]];
    Lanes ab = __builtin_shufflevector(a, b, 0, 4, 2, 6);  // x x z z
    Lanes de = __builtin_shufflevector(d, e, 0, 4, 2, 6);
    Lanes ab_y = __builtin_shufflevector(a, b, 1, 5, 3, 7);
    Lanes de_y = __builtin_shufflevector(d, e, 1, 5, 3, 7);
    return {__builtin_shufflevector(ab, de, 0, 1, 4, 5),
            __builtin_shufflevector(ab_y, de_y, 0, 1, 4, 5),
            __builtin_shufflevector(ab, de, 2, 3, 6, 7)};
}
inline void store(Lanes* slot, Plane f) {
    slot[0] = __builtin_shufflevector(f.x, f.y, 0, 4, 1, 5);
    slot[1] = __builtin_shufflevector(f.x, f.y, 2, 6, 3, 7);
}
inline void store(Lanes* slot, Space f) {
    Lanes zero = {};
    Lanes xy0 = __builtin_shufflevector(f.x, f.y, 0, 4, 1, 5);
    Lanes xy1 = __builtin_shufflevector(f.x, f.y, 2, 6, 3, 7);
    Lanes z0 = __builtin_shufflevector(f.z, zero, 0, 4, 1, 5);
    Lanes z1 = __builtin_shufflevector(f.z, zero, 2, 6, 3, 7);
    slot[0] = __builtin_shufflevector(xy0, z0, 0, 1, 4, 5);
    slot[1] = __builtin_shufflevector(xy0, z0, 2, 3, 6, 7);
    slot[2] = __builtin_shufflevector(xy1, z1, 0, 1, 4, 5);
    slot[3] = __builtin_shufflevector(xy1, z1, 2, 3, 6, 7);
}
#endif

inline Lanes side_by_side(const double* s) {
    Lanes a;
    std::memcpy(&a, s, sizeof a);
    return a;
}

inline Lanes square_root(Lanes a) {
    for (int i = 0; i < LANES; ++i) a[i] = std::sqrt(a[i]);
    return a;
}

// As in softsim/elements/metric.py.
inline Lanes inverse_cube_root(Lanes J) {
    Lanes d = J - 1.0;
    Lanes y = 1.0 + d * (d * (2.0 / 9.0) - 1.0 / 3.0);
    for (int k = 0; k < 2; ++k) {
        Lanes e = 1.0 - J * (y * y * y);
        y += y * (e * (e * (2.0 / 9.0) + 1.0 / 3.0));
    }
    return y;
}

// --- kinds of elements ---------------------------------------------------------------------------

// Symmetric tensors: METRIC[c][k] is the index of component ck; a section has zz last. OCCURS says
// how often each occurs in a contraction. `volume` is that over `scale`, the thickness / 2 or 1/6;
// its derivative by the edges is `slope`. MODES: vectors h_k that no linear field moves; with them
// the edges are d_i of softsim/elements/hourglass.py, whose words are used. T: double or Lanes.
struct PlaneStrain {
    using Node = Pair;
    using Vector = Plane;
    struct Modes {};
    static constexpr int DIMENSION = 2, COMPONENTS = 4, MODES = 0;
    static constexpr bool IS_SECTION = true, HAS_RINGS = false;
    static constexpr int METRIC[2][2] = {{0, 1}, {1, 2}};
    static constexpr double OCCURS[COMPONENTS] = {1.0, 2.0, 1.0, 1.0};
    static Lanes volume(const Plane* d) { return d[0].x * d[1].y - d[0].y * d[1].x; }
    static Lanes volume(const Plane* d, Plane* slope) {
        slope[0] = {d[1].y, -d[1].x};
        slope[1] = {-d[0].y, d[0].x};
        return volume(d);
    }
    // The components' determinant times the inverse of A.
    template <class T>
    static void adjugate(const T* A, T* result) {
        result[0] = A[2] * A[3];
        result[1] = -A[1] * A[3];
        result[2] = A[0] * A[3];
        result[3] = A[0] * A[2] - A[1] * A[1];
    }
};

struct RingSection : PlaneStrain {
    static constexpr bool HAS_RINGS = true;
};

struct Solid {
    using Node = Quad;
    using Vector = Space;
    struct Modes {};
    static constexpr int DIMENSION = 3, COMPONENTS = 6, MODES = 0;
    static constexpr bool IS_SECTION = false, HAS_RINGS = false;
    static constexpr int METRIC[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    static constexpr double OCCURS[COMPONENTS] = {1.0, 2.0, 2.0, 1.0, 2.0, 1.0};
    static Lanes volume(const Space* d) { return dot(d[0], cross(d[1], d[2])); }
    static Lanes volume(const Space* d, Space* slope) {
        slope[0] = cross(d[1], d[2]);
        slope[1] = cross(d[2], d[0]);
        slope[2] = cross(d[0], d[1]);
        return dot(d[0], slope[0]);
    }
    template <class T>
    static void adjugate(const T* A, T* result) {
        result[0] = A[3] * A[5] - A[4] * A[4];
        result[1] = A[4] * A[2] - A[1] * A[5];
        result[2] = A[1] * A[4] - A[3] * A[2];
        result[3] = A[5] * A[0] - A[2] * A[2];
        result[4] = A[2] * A[1] - A[4] * A[0];
        result[5] = A[0] * A[3] - A[1] * A[1];
    }
};

// Of kinds with modes: `split` gives g_i and h_k of the corners' places, `join` the corners' forces
// of those on g_i and h_k; `amplitudes` gives y of q, `slopes` p, the forces on q, of those on y.
// Modes: what elements have at rest, ceiling.py writes it; scale is the volume over det(D_i).
struct Quadrilateral : PlaneStrain {
    static constexpr int MODES = 1;
    struct Modes {
        Lanes scale, lean[1][2], share[1][2], fibre[2];
    };
    static void split(const Plane* x, Plane* g, Plane* h) {
        Plane diagonal = x[2] - x[0], other = x[1] - x[3];
        g[0] = 0.25 * (diagonal + other);
        g[1] = 0.25 * (diagonal - other);
        h[0] = 0.25 * ((x[0] - x[1]) + (x[2] - x[3]));
    }
    static void join(const Plane* G, const Plane* H, Plane* f) {
        Plane rising = 0.25 * (G[0] + G[1]), falling = 0.25 * (G[0] - G[1]), h = 0.25 * H[0];
        f[0] = h - rising;
        f[1] = falling - h;
        f[2] = rising + h;
        f[3] = -(falling + h);
    }
    static void amplitudes(const Modes& of, const Lanes* q, Lanes* y) {
        for (int i = 0; i < 2; ++i) y[i] = of.fibre[i] * q[i];
    }
    static void slopes(const Modes& of, const Lanes* force, Lanes* p) { amplitudes(of, force, p); }
};

struct Hexahedron : Solid {
    static constexpr int MODES = 4;
    static constexpr int CYCLIC[3][2] = {{1, 2}, {2, 0}, {0, 1}};
    struct Modes {
        Lanes scale, lean[4][3], share[4][3], length[3], plate[3][6], warping[3];
    };
    static void split(const Space* x, Space* g, Space* h) {
        Space d0 = x[1] - x[0], s0 = x[1] + x[0], d1 = x[2] - x[3], s1 = x[2] + x[3];
        Space d2 = x[5] - x[4], s2 = x[5] + x[4], d3 = x[6] - x[7], s3 = x[6] + x[7];
        h[0] = 0.125 * ((s3 - s2) - (s1 - s0));
        h[1] = 0.125 * ((d3 + d2) - (d1 + d0));
        h[2] = 0.125 * ((d3 - d2) + (d1 - d0));
        h[3] = 0.125 * ((d3 - d2) - (d1 - d0));
        g[0] = 0.125 * ((d3 + d2) + (d1 + d0));
        g[1] = 0.125 * ((s3 - s2) + (s1 - s0));
        g[2] = 0.125 * ((s3 + s2) - (s1 + s0));
    }
    static void join(const Space* G, const Space* H, Space* f) {
        for (int k = 0; k < 2; ++k) {
            double z = 2 * k - 1;
            Space g1 = G[0] + z * H[1], h3 = H[2] + z * H[3];
            Space g2 = G[1] + z * H[0], g3 = z * G[2];
            Space low = 0.125 * (g1 - h3), high = 0.125 * (g1 + h3);
            Space below = 0.125 * (g3 - g2), above = 0.125 * (g3 + g2);
            f[4 * k] = below - low;
            f[4 * k + 1] = below + low;
            f[4 * k + 2] = above + high;
            f[4 * k + 3] = above - high;
        }
    }
    static void amplitudes(const Modes& of, const Lanes* q, Lanes* y) {
        for (int k = 0; k < 3; ++k) {
            int i = CYCLIC[k][0], j = CYCLIC[k][1];
            const Lanes* L = of.plate[k];
            Lanes first = of.length[i] * q[3 * j + i], second = of.length[j] * q[3 * i + j];
            Lanes both = of.length[i] * q[4 * i] + of.length[j] * q[4 * j];
            y[3 * k] = L[0] * first + L[1] * second + L[2] * both;
            y[3 * k + 1] = L[3] * second + L[4] * both;
            y[3 * k + 2] = L[5] * both;
            y[9 + k] = of.warping[k] * q[9 + k];
        }
    }
    static void slopes(const Modes& of, const Lanes* force, Lanes* p) {
        Lanes twist[3];
        for (int k = 0; k < 3; ++k) {
            int i = CYCLIC[k][0], j = CYCLIC[k][1];
            const Lanes *L = of.plate[k], *f = force + 3 * k;
            twist[k] = L[2] * f[0] + L[4] * f[1] + L[5] * f[2];
            p[3 * j + i] = of.length[i] * (L[0] * f[0]);
            p[3 * i + j] = of.length[j] * (L[1] * f[0] + L[3] * f[1]);
            p[9 + k] = of.warping[k] * force[9 + k];
        }
        for (int i = 0; i < 3; ++i) {
            p[4 * i] = of.length[i] * (twist[CYCLIC[i][0]] + twist[CYCLIC[i][1]]);
        }
    }
};

template <class K, class T>
T contraction(const T* A, const T* B) {
    T sum = A[0] * B[0];
    for (int k = 1; k < K::COMPONENTS; ++k) sum += K::OCCURS[k] * (A[k] * B[k]);
    return sum;
}

template <class K, class T>
T determinant(const T* A) {  // by the first row, or of a section by zz
    T of[K::COMPONENTS];
    K::adjugate(A, of);
    if constexpr (K::IS_SECTION) return A[3] * of[3];
    return A[0] * of[0] + A[1] * of[1] + A[2] * of[2];
}

// Every `held_for` increments a branch relaxes by a share towards the strain `behind` steps ago.
struct Relaxation {
    double modulus, share, behind;
    long held_for;

    Relaxation(double modulus, double relaxation_time, double dt) : modulus(modulus) {
        double steps = relaxation_time / dt;
        held_for = std::clamp(long(steps / 8.0), 1L, 8L);
        share = -std::expm1(-held_for / steps);
        behind = steps - held_for / std::expm1(held_for / steps) - 0.5 * (held_for - 1);
    }
};

// --- memory and threads --------------------------------------------------------------------------

template <class T>
class Array {  // zeroed, on huge pages where there are any
    T* data_ = nullptr;

  public:
    explicit Array(size_t count) {
        constexpr size_t PAGE = size_t(2) << 20;
        size_t bytes = (count * sizeof(T) + PAGE - 1) / PAGE * PAGE;
        data_ = static_cast<T*>(std::aligned_alloc(PAGE, bytes));
        if (!data_) std::abort();
#ifdef __linux__
        madvise(data_, bytes, MADV_HUGEPAGE);
#endif
        std::memset(static_cast<void*>(data_), 0, bytes);
    }
    Array(const Array&) = delete;
    Array& operator=(const Array&) = delete;
    ~Array() { std::free(data_); }
    T& operator[](size_t i) { return data_[i]; }
    T* data() { return data_; }
};

class Barrier {  // spins: sleeping threads would wake later than a pass takes
    static constexpr int PATIENCE = 20000;  // then another process has the core: leave it ours
    std::atomic<int> arrived_{0}, round_{0};
    int threads_;

  public:
    explicit Barrier(int threads) : threads_(threads) {}
    void wait() {
        if (threads_ == 1) return;
        int round = round_.load(std::memory_order_relaxed);
        if (arrived_.fetch_add(1, std::memory_order_acq_rel) == threads_ - 1) {
            arrived_.store(0, std::memory_order_relaxed);
            round_.store(round + 1, std::memory_order_release);
            return;
        }
        for (int k = 0; round_.load(std::memory_order_acquire) == round; ++k) {
            if (k > PATIENCE) std::this_thread::yield();
        }
    }
};

// --- the problem ---------------------------------------------------------------------------------

struct Branch {
    double modulus, relaxation_time;
};

struct Problem {
    int64_t dimension, corners, nodes, cells, branch_count, has_rings;
    int64_t mode_numbers;  // that a cell with hourglass modes has at rest, or zero
    double thickness, sector, dt, bulk_modulus, C10, C20, C30;
    std::vector<Branch> branches;
    std::vector<double> gravity;                              // (d)
    std::vector<double> points, position, velocity;           // (nodes, d)
    std::vector<double> inverse_mass;                         // (nodes, d), zero where held
    std::vector<double> bulk_viscosity;                       // (pressures) b_a [Pa s]
    std::vector<int32_t> corner;                              // (cells, corners), in a band
    std::vector<double> basis, modes;  // (cells, d, d) D_i, (cells, mode_numbers), or empty
    std::vector<int32_t> opposite, is_ring;                   // (nodes), (cells), or empty

    double length(size_t a, size_t b) const {  // of nodes at rest, in the plane
        return std::hypot(points[2 * a] - points[2 * b], points[2 * a + 1] - points[2 * b + 1]);
    }
    // Sum of the diameters at the corners of a ring cell at rest.
    double diameters(long cell) const {
        double sum = 0.0;
        for (long c = 0; c < 3; ++c) {
            int32_t a = corner[cell * 3 + c];
            sum += length(a, opposite[a]);
        }
        return sum;
    }
    // Of a cell: its volume over det(edges).
    double scale(long cell) const {
        if (mode_numbers) return modes[cell * mode_numbers];
        if (dimension == 3) return 1.0 / 6.0;
        if (has_rings && is_ring[cell]) return 0.5 * sector * diameters(cell) / 6.0;
        return 0.5 * thickness;
    }
};

Problem read_problem(const char* path) {
    std::ifstream file(path, std::ios::binary);
    Problem p;
    auto read = [&](auto* to, size_t count) {
        file.read(reinterpret_cast<char*>(to), std::streamsize(count * sizeof *to));
    };
    read(&p.dimension, 7);
    read(&p.thickness, 7);
    size_t d = size_t(p.dimension), n = size_t(p.nodes);
    p.branches.resize(size_t(p.branch_count));
    read(p.branches.data(), p.branches.size());
    auto numbers = [&](std::vector<double>& to, size_t count) {
        to.resize(count);
        read(to.data(), count);
    };
    numbers(p.gravity, d);
    for (auto* a : {&p.points, &p.position, &p.velocity, &p.inverse_mass}) numbers(*a, n * d);
    size_t cells = size_t(p.cells);
    numbers(p.bulk_viscosity, p.mode_numbers ? cells : n);
    p.corner.resize(cells * size_t(p.corners));
    read(p.corner.data(), p.corner.size());
    if (p.mode_numbers) {
        numbers(p.basis, cells * d * d);
        numbers(p.modes, cells * size_t(p.mode_numbers));
    }
    if (p.has_rings) {
        p.opposite.resize(n);
        p.is_ring.resize(cells);
        read(p.opposite.data(), n);
        read(p.is_ring.data(), p.is_ring.size());
    }
    if (!file) {
        std::fprintf(stderr, "cannot read %s\n", path);
        std::exit(2);
    }
    return p;
}

// --- where everything lies -----------------------------------------------------------------------

// The elements and nodes of one thread. Its elements lie in [first_block, end_block), its nodes in
// slices of LANES, those that only it touches first.
struct Part {
    long first_block, end_block, first_slice, shared_slice, end_slice;
};

struct Layout {
    std::vector<Part> parts;
    std::vector<long> cell_at;  // by (block, lane): the cell, -1 where there is none
    std::vector<long> node_at;  // by (slice, lane): the node, -1 where there is none
};

constexpr long WINDOW = 64;  // nodes sorted by how many elements they have

// Cells come in the order of their lowest nodes, which are numbered for a narrow band. Every
// other thread goes through its share backwards, so that two meet at their interface at the end.
Layout lay_out(const Problem& p, long threads) {
    Layout layout;
    std::vector<long> last(p.nodes, -1), owner(p.nodes, -1), degree(p.nodes, 0);
    std::vector<bool> shared(p.nodes, false);
    for (long t = 0; t < threads; ++t) {
        long from = p.cells * t / threads, to = p.cells * (t + 1) / threads;
        long first = long(layout.cell_at.size());
        for (long k = 0; k < to - from; ++k) layout.cell_at.push_back(t % 2 ? to - 1 - k : from + k);
        for (size_t e = size_t(first); e < layout.cell_at.size(); ++e) {
            for (long c = 0; c < p.corners; ++c) {
                int32_t a = p.corner[layout.cell_at[e] * p.corners + c];
                shared[a] = shared[a] || (owner[a] >= 0 && owner[a] != t);
                if (owner[a] < 0) owner[a] = t;
                if (owner[a] == t) last[a] = long(e);
                ++degree[a];
            }
        }
        while (layout.cell_at.size() % LANES) layout.cell_at.push_back(-1);
        layout.parts.push_back({first / LANES, long(layout.cell_at.size()) / LANES, 0, 0, 0});
    }
    std::vector<long> order(p.nodes);
    for (long a = 0; a < p.nodes; ++a) order[a] = a;
    // A node can be collected after its last element: nodes in that order.
    std::stable_sort(order.begin(), order.end(), [&](long a, long b) { return last[a] < last[b]; });
    auto append = [&](long t, bool is_shared) {
        std::vector<long> chosen;
        std::copy_if(order.begin(), order.end(), std::back_inserter(chosen),
                     [&](long a) { return owner[a] == t && shared[a] == is_shared; });
        for (long w = 0; w < long(chosen.size()); w += WINDOW) {
            auto end = chosen.begin() + std::min(w + WINDOW, long(chosen.size()));
            std::stable_sort(chosen.begin() + w, end,
                             [&](long a, long b) { return degree[a] > degree[b]; });
        }
        layout.node_at.insert(layout.node_at.end(), chosen.begin(), chosen.end());
        while (layout.node_at.size() % LANES) layout.node_at.push_back(-1);
        return long(layout.node_at.size()) / LANES;
    };
    long slices = 0;
    for (long t = 0; t < threads; ++t) {
        Part& part = layout.parts[t];
        part.first_slice = slices;
        part.shared_slice = append(t, false);
        part.end_slice = slices = append(t, true);
    }
    return layout;
}

// --- diameters of rings --------------------------------------------------------------------------

// Each has two ends, opposite nodes, and the ring cells around either of them.
struct Diameters {
    std::vector<std::array<int32_t, 2>> ends;
    std::vector<std::vector<int32_t>> cells;
    std::vector<int32_t> of_node;  // -1 where a node is on none
};

Diameters list_diameters(const Problem& p) {
    Diameters found{{}, {}, std::vector<int32_t>(p.nodes, -1)};
    for (size_t e = 0; e < p.is_ring.size(); ++e) {
        for (size_t c = 0; p.is_ring[e] && c < 3; ++c) {
            int32_t a = p.corner[3 * e + c];
            if (found.of_node[a] < 0) {
                found.of_node[a] = found.of_node[p.opposite[a]] = int32_t(found.ends.size());
                found.ends.push_back({a, p.opposite[a]});
                found.cells.emplace_back();
            }
            found.cells[found.of_node[a]].push_back(int32_t(e));
        }
    }
    return found;
}

// --- the increment -------------------------------------------------------------------------------

struct Energies {
    double kinetic, stored, dissipated;
};

template <class K>
class Solver {
    using Node = typename K::Node;
    using Vector = typename K::Vector;
    using Modes = typename K::Modes;
    static constexpr int D = K::DIMENSION, METRICS = D * (D + 1) / 2;
    static constexpr bool HAS_MODES = K::MODES > 0;
    static constexpr int CORNERS = HAS_MODES ? 1 << D : D + 1, AMPLITUDES = K::MODES * D;
    // Pressures that a mean is of, those of the nodes; or the element's own.
    static constexpr int SHARES = HAS_MODES ? 1 : CORNERS;
    static constexpr int SLOT = sizeof(Node);
    static constexpr int WIDE = SLOT / sizeof(double);  // Lanes that LANES nodes fill

    struct Reference {
        Lanes metric[METRICS];  // -V I_ck = -V grad N_c . grad N_k, the sign that forces want
        Lanes inverse_volume;
    };
    struct Tensor {
        Lanes of[K::COMPONENTS];
    };
    struct Edges {
        Vector d[D];
    };
    struct Ring {  // F_zz = single + slope * (sum of the corners' diameters)
        Lanes scale, slope, single, volume;
    };
    struct Slice {
        uint32_t first, degree;  // its slots: first + LANES k + lane, k < degree
    };
    // How far each pass has come when a sweep pauses to let the next pass follow.
    struct Stage {
        long measured, pressed, stressed, kicked;
    };
    static constexpr long CHUNK = 64;  // blocks a stage measures

    const Problem& problem_;
    Layout layout_;
    Diameters diameters_;
    long blocks_, slices_, diameter_blocks_;
    std::vector<Relaxation> branch_;
    double whole_modulus_ = 0.0;  // of the branches
    std::vector<Corner> corner_;  // (blocks, corners)
    Array<Reference> reference_;
    Array<Edges> edges_;
    Array<Lanes> volume_;  // of elements, by block
    // (blocks + 1, corners, lanes) of nodes' vectors, then (diameter blocks, ends, lanes).
    Array<Lanes> corner_force_;
    Array<Tensor> relaxing_;    // (blocks, branches): -mu V A
    Array<Tensor> branches_;    // their sum, by block
    Array<Tensor> last_C_bar_;  // of elements, by block
    Array<Lanes> metric_work_;  // integral of C_bar : dB, B = sum mu V A [J]
    std::vector<Slice> volume_slice_, force_slice_, tension_slice_;
    std::vector<uint32_t> volume_slot_, force_slot_, tension_slot_;  // byte offsets
    Array<Node> position_, velocity_, inverse_mass_;
    // Of pressures, by slice of nodes or block of elements.
    Array<Lanes> J_, pressure_, inverse_whole_, viscosity_;
    Array<Lanes> viscous_, bulk_work_;  // pressure by bulk viscosity; its integral dJ, twice
    Array<Modes> modes_;
    Array<Lanes> last_y_, pulling_y_;   // (blocks, amplitudes); sum mu r of the branches
    Array<Lanes> relaxing_y_;           // r (blocks, branches, amplitudes)
    Array<Lanes> mode_work_;            // dissipated by the branches of the springs [J]
    Array<Ring> ring_;
    Array<Lanes> hoop_, tension_;       // of elements: F_zz, what they pull diameters with
    std::vector<Corner> diameter_at_, end_;  // (blocks, corners), (diameter blocks, ends)
    Array<double> length_;              // of diameters; the last one stays zero
    Array<Vector> direction_;
    std::vector<std::vector<Stage>> plan_;
    Barrier barrier_;

  public:
    Solver(const Problem& p, int threads)
        : problem_(p),
          layout_(lay_out(p, threads)),
          diameters_(list_diameters(p)),
          blocks_(long(layout_.cell_at.size()) / LANES),
          slices_(long(layout_.node_at.size()) / LANES),
          diameter_blocks_((long(diameters_.ends.size()) + LANES - 1) / LANES),
          corner_(blocks_ * CORNERS),
          reference_(blocks_),
          edges_(blocks_),
          volume_(blocks_ + 1),
          corner_force_(((blocks_ + 1) * CORNERS + 2 * diameter_blocks_) * WIDE),
          relaxing_(blocks_ * p.branches.size() + 1),
          branches_(p.branches.empty() ? 1 : blocks_),
          last_C_bar_(p.branches.empty() ? 1 : blocks_),
          metric_work_(p.branches.empty() ? 1 : blocks_),
          position_((slices_ + 1) * LANES),
          velocity_((slices_ + 1) * LANES),
          inverse_mass_((slices_ + 1) * LANES),
          J_(pressure_slices()),
          pressure_(slices_ + 1),
          inverse_whole_(pressure_slices()),
          viscosity_(pressure_slices()),
          viscous_(pressure_slices()),
          bulk_work_(pressure_slices()),
          modes_(HAS_MODES ? blocks_ : 1),
          last_y_(blocks_ * AMPLITUDES + 1),
          pulling_y_(blocks_ * AMPLITUDES + 1),
          relaxing_y_(blocks_ * AMPLITUDES * p.branches.size() + 1),
          mode_work_(HAS_MODES ? blocks_ : 1),
          ring_(K::HAS_RINGS ? blocks_ : 1),
          hoop_(K::HAS_RINGS ? blocks_ : 1),
          tension_(K::HAS_RINGS ? blocks_ + 1 : 1),
          diameter_at_(K::HAS_RINGS ? blocks_ * CORNERS : 0),
          end_(2 * diameter_blocks_),
          length_(diameter_blocks_ * LANES + 1),
          direction_(diameter_blocks_ + 1),
          barrier_(threads) {
        for (const Branch& branch : p.branches) {
            branch_.emplace_back(branch.modulus, branch.relaxation_time, p.dt);
            whole_modulus_ += branch.modulus;
        }
        place_nodes();
        place_pressures();
        place_elements();
        if constexpr (K::HAS_RINGS) place_diameters();
        for (const Part& part : layout_.parts) plan_.push_back(planned(part));
    }

    // Forces at the start and half a kick, then `repeats` times `increments` increments; run by
    // every thread. Takes the seconds of each repeat.
    void run(int thread, long increments, long repeats, std::vector<double>& seconds) {
        double dt = problem_.dt;
        long number = 1;
        increment(thread, number, 0.5 * dt, 0.0);
        forget_dissipation(layout_.parts[thread]);
        for (long r = 0; r < repeats; ++r) {
            auto start = std::chrono::steady_clock::now();
            drift(layout_.parts[thread], dt);
            barrier_.wait();
            // The drift of the next increment rides on the kick.
            for (long k = 0; k < increments; ++k) {
                increment(thread, ++number, dt, k + 1 < increments ? dt : 0.0);
            }
            std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
            if (thread == 0) seconds.push_back(took.count());
        }
    }

    std::vector<double> positions() {
        std::vector<double> result(problem_.nodes * D);
        for (long k = 0; k < slices_ * LANES; ++k) {
            long a = layout_.node_at[k];
            for (int i = 0; a >= 0 && i < D; ++i) result[a * D + i] = position_[k][i];
        }
        return result;
    }

    // At the time of the positions: takes velocities back by half a kick, and ends the run.
    Energies energies() {
        kick(0, slices_, -0.5 * problem_.dt, 0.0);
        Energies sum{0.0, 0.0, 0.0};
        for (long k = 0; k < slices_ * LANES; ++k) {
            for (int i = 0; layout_.node_at[k] >= 0 && i < D; ++i) {
                double v = velocity_[k][i], inverse_mass = inverse_mass_[k][i];
                if (inverse_mass > 0.0) sum.kinetic += 0.5 * v * v / inverse_mass;
            }
        }
        add_volumetric(sum);
        for (long e = 0; e < blocks_ * LANES; ++e) {
            if (layout_.cell_at[e] >= 0) add_isochoric(sum, e / LANES, int(e % LANES));
        }
        return sum;
    }

  private:
    long pressure_slices() const { return HAS_MODES ? blocks_ : slices_; }

    // By (slice, lane): the pressure, -1 where there is none.
    const std::vector<long>& pressure_at() const {
        return HAS_MODES ? layout_.cell_at : layout_.node_at;
    }

    void place_pressures() {
        for (long k = 0; k < pressure_slices() * LANES; ++k) {
            long a = pressure_at()[k];
            J_[k / LANES][k % LANES] = 1.0;
            if (a >= 0) viscosity_[k / LANES][k % LANES] = problem_.bulk_viscosity[a];
        }
    }

    void place_nodes() {
        const Problem& p = problem_;
        for (long k = 0; k < slices_ * LANES; ++k) {
            long a = layout_.node_at[k];
            if (a < 0) continue;
            for (int i = 0; i < D; ++i) {
                position_[k][i] = p.position[a * D + i];
                velocity_[k][i] = p.velocity[a * D + i];
                inverse_mass_[k][i] = p.inverse_mass[a * D + i];
            }
        }
    }

    // Where each node lies: its slice times LANES, and its lane.
    std::vector<long> places() {
        std::vector<long> place(problem_.nodes);
        for (long k = 0; k < slices_ * LANES; ++k) {
            if (layout_.node_at[k] >= 0) place[layout_.node_at[k]] = k;
        }
        return place;
    }

    void place_elements() {
        const Problem& p = problem_;
        std::vector<long> place = places();
        std::vector<std::vector<uint32_t>> volumes(slices_ * LANES), forces(slices_ * LANES);
        std::vector<double> node_volume(slices_ * LANES, 0.0);
        long nowhere = slices_ * LANES;  // a node at the origin, for lanes without an element
        for (long e = 0; e < blocks_ * LANES; ++e) {
            long cell = layout_.cell_at[e], b = e / LANES;
            int lane = int(e % LANES);
            double volume = cell < 0 ? 0.0 : set_reference(b, lane, cell);
            if (HAS_MODES && cell >= 0) inverse_whole_[b][lane] = 1.0 / volume;
            for (int c = 0; c < CORNERS; ++c) {
                long k = cell < 0 ? nowhere : place[p.corner[cell * CORNERS + c]];
                corner_[b * CORNERS + c][lane] = int32_t(k);
                if (cell < 0) continue;
                if (!HAS_MODES) volumes[k].push_back(uint32_t(e * sizeof(double)));
                forces[k].push_back(uint32_t(((b * CORNERS + c) * LANES + lane) * SLOT));
                node_volume[k] += volume;
            }
        }
        for (size_t g = 0; g < diameters_.ends.size(); ++g) {
            for (size_t end = 0; end < 2; ++end) {
                size_t row = (blocks_ + 1) * CORNERS + 2 * (g / LANES) + end;
                uint32_t slot = uint32_t((row * LANES + g % LANES) * SLOT);
                forces[place[diameters_.ends[g][end]]].push_back(slot);
            }
        }
        for (long q = 0; q < slices_; ++q) {  // block number `blocks_` stays zero
            list(&volumes[q * LANES], blocks_ * sizeof(Lanes), volume_slice_, volume_slot_);
            list(&forces[q * LANES], blocks_ * CORNERS * LANES * SLOT, force_slice_, force_slot_);
            for (int i = 0; !HAS_MODES && i < LANES; ++i) {
                double volume = node_volume[q * LANES + i];
                inverse_whole_[q][i] = volume > 0.0 ? 1.0 / volume : 0.0;
            }
        }
    }

    // Add a slice whose lanes have these slots, filled up by an empty one.
    static void list(const std::vector<uint32_t>* lists, size_t empty, std::vector<Slice>& slices,
                     std::vector<uint32_t>& slots) {
        size_t degree = 0;
        for (int i = 0; i < LANES; ++i) degree = std::max(degree, lists[i].size());
        slices.push_back({uint32_t(slots.size()), uint32_t(degree)});
        for (size_t k = 0; k < degree; ++k) {
            for (int i = 0; i < LANES; ++i) {
                slots.push_back(k < lists[i].size() ? lists[i][k] : uint32_t(empty));
            }
        }
    }

    // Of an element at rest; returns its volume.
    double set_reference(long b, int lane, long cell) {
        const int32_t* nodes = &problem_.corner[cell * CORNERS];
        double d[D][D], grad[D][D], metric[K::COMPONENTS];
        for (int c = 0; c < D; ++c) {
            for (int i = 0; i < D; ++i) {
                const double* x = problem_.points.data();
                d[c][i] = HAS_MODES ? problem_.basis[(cell * D + c) * D + i]
                                    : x[nodes[c + 1] * D + i] - x[nodes[0] * D + i];
            }
        }
        if constexpr (HAS_MODES) {
            Lanes* of = reinterpret_cast<Lanes*>(&modes_[b]);
            for (long k = 0; k < problem_.mode_numbers; ++k) {
                of[k][lane] = problem_.modes[cell * problem_.mode_numbers + k];
            }
        }
        double det = 0.0;
        if constexpr (D == 2) {
            grad[0][0] = d[1][1], grad[0][1] = -d[1][0], grad[1][0] = -d[0][1], grad[1][1] = d[0][0];
        } else {
            for (int c = 0; c < 3; ++c) {
                for (int i = 0; i < 3; ++i) {
                    const double *u = d[(c + 1) % 3], *v = d[(c + 2) % 3];
                    int j = (i + 1) % 3, k = (i + 2) % 3;
                    grad[c][i] = u[j] * v[k] - u[k] * v[j];
                }
            }
        }
        for (int i = 0; i < D; ++i) det += d[0][i] * grad[0][i];
        double volume = det * problem_.scale(cell);
        if constexpr (K::IS_SECTION) metric[METRICS] = -volume;  // zz
        for (int c = 0; c < D; ++c) {
            for (int k = c; k < D; ++k) {
                double product = 0.0;
                for (int i = 0; i < D; ++i) product += grad[c][i] * grad[k][i] / (det * det);
                metric[K::METRIC[c][k]] = -volume * product;
            }
        }
        for (int m = 0; m < METRICS; ++m) reference_[b].metric[m][lane] = metric[m];
        reference_[b].inverse_volume[lane] = 1.0 / volume;
        if (!branch_.empty()) set_branches(b, lane, metric, volume);
        return volume;
    }

    // At rest A = I and C_bar = I^-1. metric: -V I.
    void set_branches(long b, int lane, const double* metric, double volume) {
        double adjugate[K::COMPONENTS], det = determinant<K>(metric);
        K::adjugate(metric, adjugate);
        for (int m = 0; m < K::COMPONENTS; ++m) {
            last_C_bar_[b].of[m][lane] = -volume * adjugate[m] / det;
            for (size_t k = 0; k < branch_.size(); ++k) {
                relaxing_[b * branch_.size() + k].of[m][lane] = branch_[k].modulus * metric[m];
            }
            branches_[b].of[m][lane] = whole_modulus_ * metric[m];
        }
    }

    void place_diameters() {
        std::vector<long> place = places(), element_of(problem_.cells);
        int32_t nowhere = int32_t(diameter_blocks_ * LANES);
        for (long e = 0; e < blocks_ * LANES; ++e) {
            long cell = layout_.cell_at[e], b = e / LANES;
            int lane = int(e % LANES);
            bool is_ring = cell >= 0 && problem_.is_ring[cell];
            for (int c = 0; c < CORNERS; ++c) {
                diameter_at_[b * CORNERS + c][lane] =
                    is_ring ? diameters_.of_node[problem_.corner[cell * CORNERS + c]] : nowhere;
            }
            if (cell < 0) continue;
            element_of[cell] = e;
            ring_[b].scale[lane] = problem_.scale(cell);
            ring_[b].slope[lane] = is_ring ? 1.0 / problem_.diameters(cell) : 0.0;
            ring_[b].single[lane] = is_ring ? 0.0 : 1.0;
            ring_[b].volume[lane] = 1.0 / reference_[b].inverse_volume[lane];
        }
        std::vector<std::vector<uint32_t>> pulling(nowhere);
        for (int32_t g = 0; g < nowhere; ++g) {
            // Spare lanes measure the last diameter once more and pull at nothing.
            size_t listed = std::min(size_t(g), diameters_.ends.size() - 1);
            for (int end = 0; end < 2; ++end) {
                end_[g / LANES * 2 + end][g % LANES] = int32_t(place[diameters_.ends[listed][end]]);
            }
            if (size_t(g) != listed) continue;
            for (int32_t cell : diameters_.cells[g]) {
                pulling[g].push_back(uint32_t(element_of[cell] * sizeof(double)));
            }
        }
        for (long g = 0; g < diameter_blocks_; ++g) {
            list(&pulling[g * LANES], blocks_ * sizeof(Lanes), tension_slice_, tension_slot_);
        }
    }

    // Let every pass follow as closely as it may: pressure when all volumes of a node are measured,
    // stress when all nodes of a block are pressed, kick when all elements of a node are stressed.
    std::vector<Stage> planned(const Part& part) {
        std::vector<long> last_block(slices_, -1), last_slice(blocks_, -1);
        for (long b = part.first_block; b < part.end_block; ++b) {
            for (int c = 0; c < CORNERS; ++c) {
                for (int32_t k : corner_[b * CORNERS + c]) {
                    if (k / LANES == slices_) continue;
                    last_block[k / LANES] = b;
                    bool waits = k / LANES < part.first_slice || k / LANES >= part.shared_slice;
                    last_slice[b] = std::max(last_slice[b], waits ? slices_ : long(k / LANES));
                }
            }
        }
        std::vector<Stage> plan;
        Stage now{part.first_block, part.first_slice, part.first_block, part.first_slice};
        long kicked_end = K::HAS_RINGS ? part.first_slice : part.shared_slice;
        while (now.measured < part.end_block) {
            now.measured = std::min(now.measured + CHUNK, part.end_block);
            long end = part.shared_slice;
            if (HAS_MODES) now.pressed = end, now.stressed = now.measured;
            while (now.pressed < end && last_block[now.pressed] < now.measured) ++now.pressed;
            while (now.stressed < now.measured && last_slice[now.stressed] < now.pressed) {
                ++now.stressed;
            }
            long ready = std::min(now.pressed, kicked_end);
            while (now.kicked < ready && last_block[now.kicked] < now.stressed) ++now.kicked;
            plan.push_back(now);
        }
        return plan;
    }

    // Bit k: branch k relaxes in the increment of this number.
    unsigned due_in(long number) {
        unsigned due = 0;
        for (size_t k = 0; k < branch_.size(); ++k) {
            if (number % branch_[k].held_for == 0) due |= 1u << k;
        }
        return due;
    }

    void increment(int thread, long number, double kick_dt, double drift_dt) {
        const Part& part = layout_.parts[thread];
        unsigned due = due_in(number);
        long threads = long(layout_.parts.size());
        long first_diameter = diameter_blocks_ * thread / threads;
        long end_diameter = diameter_blocks_ * (thread + 1) / threads;
        if constexpr (K::HAS_RINGS) {
            gauge(first_diameter, end_diameter);
            barrier_.wait();
        }
        Stage done{part.first_block, part.first_slice, part.first_block, part.first_slice};
        for (const Stage& next : plan_[thread]) {
            measure(done.measured, next.measured);
            press(done.pressed, next.pressed);
            stress(done.stressed, next.stressed, due);
            kick(done.kicked, next.kicked, kick_dt, drift_dt);
            done = next;
        }
        barrier_.wait();
        press(done.pressed, part.end_slice);
        barrier_.wait();
        stress(done.stressed, part.end_block, due);
        barrier_.wait();
        if constexpr (K::HAS_RINGS) {
            pull(first_diameter, end_diameter);
            barrier_.wait();
        }
        kick(done.kicked, part.end_slice, kick_dt, drift_dt);
        barrier_.wait();
    }

    void drift(const Part& part, double dt) {
        for (long k = part.first_slice * LANES; k < part.end_slice * LANES; ++k) {
            position_[k] += dt * velocity_[k];
        }
    }

    void forget_dissipation(const Part& part) {
        long from = HAS_MODES ? part.first_block : part.first_slice;
        long to = HAS_MODES ? part.end_block : part.end_slice;
        for (long q = from; q < to; ++q) bulk_work_[q] = Lanes{};
        if (branch_.empty()) return;
        for (long b = part.first_block; b < part.end_block; ++b) {
            metric_work_[b] = Lanes{};
            if (HAS_MODES) mode_work_[b] = Lanes{};
        }
    }

    // Lengths and directions of diameters.
    void gauge(long from, long to) {
        const Node* x = position_.data();
        for (long g = from; g < to; ++g) {
            Vector d = gather(x, end_[2 * g]) - gather(x, end_[2 * g + 1]);
            Lanes length = square_root(dot(d, d));
            direction_[g] = (1.0 / length) * d;
            std::memcpy(&length_[g * LANES], &length, sizeof length);
        }
    }

    // Edges and volumes, of elements whose pressures wait for them.
    void measure(long from, long to) {
        if constexpr (HAS_MODES) return;
        const Node* x = position_.data();
        for (long b = from; b < to; ++b) {
            const Corner* corner = &corner_[b * CORNERS];
            Vector x0 = gather(x, corner[0]), d[D];
            for (int c = 0; c < D; ++c) {
                d[c] = gather(x, corner[c + 1]) - x0;
                edges_[b].d[c] = d[c];
            }
            if constexpr (K::HAS_RINGS) measure_ring(b);
            volume_[b] = K::volume(d) * (scale_at_rest(b) * hoop(b));
        }
    }

    void measure_ring(long b) {
        const Corner* at = &diameter_at_[b * CORNERS];
        double sum[LANES];
        for (int i = 0; i < LANES; ++i) {
            sum[i] = length_[at[0][i]] + length_[at[1][i]] + length_[at[2][i]];
        }
        hoop_[b] = ring_[b].single + side_by_side(sum) * ring_[b].slope;
    }

    // F_zz.
    Lanes hoop(long b) {
        if constexpr (K::HAS_RINGS) return hoop_[b];
        return Lanes{} + 1.0;
    }

    // Edges of a block, and what is left of its hourglass modes.
    void deform(long b, Vector* d, Vector* h) {
        if constexpr (HAS_MODES) {
            const Modes& of = modes_[b];
            Vector x[CORNERS];
            for (int c = 0; c < CORNERS; ++c) {
                x[c] = gather(position_.data(), corner_[b * CORNERS + c]);
            }
            K::split(x, d, h);
            for (int i = 0; i < D; ++i) {
                for (int k = 0; k < K::MODES; ++k) d[i] = d[i] + of.lean[k][i] * h[k];
            }
            for (int k = 0; k < K::MODES; ++k) {
                for (int i = 0; i < D; ++i) h[k] = h[k] - of.share[k][i] * d[i];
            }
        } else {
            for (int c = 0; c < D; ++c) d[c] = copied(edges_[b].d[c]);
        }
    }

    // Volume over that of K::volume, as long as F_zz = 1.
    Lanes scale_at_rest(long b) {
        if constexpr (HAS_MODES) return modes_[b].scale;
        if constexpr (K::HAS_RINGS) return ring_[b].scale;
        return Lanes{} + (D == 2 ? 0.5 * problem_.thickness : 1.0 / 6.0);
    }

    // C = F^T F.
    void stretch(long b, const Vector* d, Lanes* C) {
        for (int c = 0; c < D; ++c) {
            for (int k = c; k < D; ++k) C[K::METRIC[c][k]] = dot(d[c], d[k]);
        }
        if constexpr (K::IS_SECTION) C[METRICS] = hoop(b) * hoop(b);
    }

    Lanes first_invariant(const Reference& reference, const Lanes* C) {
        Lanes sum = reference.metric[0] * C[0];
        for (int m = 1; m < METRICS; ++m) sum += K::OCCURS[m] * (reference.metric[m] * C[m]);
        Lanes across = {};
        if constexpr (K::IS_SECTION) across = C[METRICS];
        return across - sum * reference.inverse_volume;
    }

    // p_a / shares, at J: they sum to the element's mean.
    Lanes compress(long q, Lanes J) {
        double stiffness = problem_.bulk_modulus / SHARES, rate = 1.0 / (SHARES * problem_.dt);
        Lanes dJ = J - J_[q], viscous = rate * viscosity_[q] * dJ;
        bulk_work_[q] += (viscous_[q] + viscous) * dJ;
        viscous_[q] = viscous;
        J_[q] = J;
        return stiffness * (J - 1.0) + viscous;
    }

    // Pressures of the nodes.
    void press(long from, long to) {
        if constexpr (HAS_MODES) return;
        const char* volume = reinterpret_cast<const char*>(volume_.data());
        for (long q = from; q < to; ++q) {
            const uint32_t* slot = &volume_slot_[volume_slice_[q].first];
            double sum[LANES] = {};
            for (uint32_t k = 0; k < volume_slice_[q].degree; ++k, slot += LANES) {
                for (int i = 0; i < LANES; ++i) {
                    sum[i] += *reinterpret_cast<const double*>(volume + slot[i]);
                }
            }
            pressure_[q] = compress(q, side_by_side(sum) * inverse_whole_[q]);
        }
    }

    // Sum of the pressures at the corners of a block.
    Lanes averaged(long b) {
        const double* p = reinterpret_cast<const double*>(pressure_.data());
        const Corner* corner = &corner_[b * CORNERS];
        double sum[LANES];
        for (int i = 0; i < LANES; ++i) {
            sum[i] = p[corner[0][i]];
            for (int c = 1; c < CORNERS; ++c) sum[i] += p[corner[c][i]];
        }
        return side_by_side(sum);
    }

    // f_c = -(sum_k T_ck d_k + h dV/dx_c) with T = J^(-2/3) V M, h = p - T : C / (3 V J).
    void stress(long from, long to, unsigned due) {
        double c0 = 2.0 * problem_.C10, c1 = 4.0 * problem_.C20, c2 = 6.0 * problem_.C30;
        for (long b = from; b < to; ++b) {
            Vector d[D], slope[D], f[D], bent[K::MODES + 1];
            Lanes C[K::COMPONENTS], T[K::COMPONENTS];
            deform(b, d, bent);
            const Reference& reference = reference_[b];
            Lanes plain = K::volume(d, slope) * scale_at_rest(b);  // V J / F_zz
            Lanes J = plain * hoop(b) * reference.inverse_volume;
            Lanes mean = HAS_MODES ? compress(b, J) : averaged(b);
            stretch(b, d, C);
            Lanes r = inverse_cube_root(J), r2 = r * r;
            Lanes I1 = first_invariant(reference, C);
            Lanes k1 = r2 * I1 - 3.0;
            Lanes a = r2 * (c0 + k1 * (c1 + k1 * c2));
            Lanes trace = a * I1;  // T : C / V
            for (int m = 0; m < METRICS; ++m) T[m] = a * reference.metric[m];
            if constexpr (K::HAS_RINGS) T[METRICS] = -a * ring_[b].volume;
            if (!branch_.empty()) {
                Tensor C_bar;
                for (int m = 0; m < K::COMPONENTS; ++m) C_bar.of[m] = r2 * C[m];
                if (due) relax(b, C_bar.of, due);
                last_C_bar_[b] = C_bar;
                const Lanes* branches = branches_[b].of;
                trace -= contraction<K>(C_bar.of, branches) * reference.inverse_volume;
                for (int m = 0; m < (K::HAS_RINGS ? K::COMPONENTS : METRICS); ++m) {
                    T[m] += r2 * branches[m];
                }
            }
            Lanes h = mean - trace * (1.0 / 3.0) * (r2 * r);
            if constexpr (K::HAS_RINGS) {
                tension_[b] = ring_[b].slope * (h * plain - hoop_[b] * T[METRICS]);
            }
            Lanes push = -(scale_at_rest(b) * hoop(b)) * h;
            for (int c = 0; c < D; ++c) {
                f[c] = push * slope[c];
                for (int k = 0; k < D; ++k) f[c] = f[c] + T[K::METRIC[c][k]] * d[k];
            }
            if constexpr (HAS_MODES) {
                bend(b, d, bent, f, due);
            } else {
                Vector balance = f[0];
                for (int c = 1; c < D; ++c) balance = balance + f[c];
                for (int c = 0; c < D; ++c) store(force_of(b, c + 1), f[c]);
                store(force_of(b, 0), -balance);
            }
        }
    }

    // q, with e_i and 1 / |d_i|.
    static void turn(const Vector* d, const Vector* h, Vector* e, Lanes* root, Lanes* q) {
        for (int i = 0; i < D; ++i) {
            root[i] = 1.0 / square_root(dot(d[i], d[i]));
            e[i] = root[i] * d[i];
        }
        for (int m = 0; m < AMPLITUDES; ++m) q[m] = dot(e[m % D], h[m / D]);
    }

    // Corner forces of those on the edges, f, and of the hourglass modes.
    void bend(long b, const Vector* d, const Vector* h, const Vector* f, unsigned due) {
        const Modes& of = modes_[b];
        Lanes root[D], q[AMPLITUDES], y[AMPLITUDES], p[AMPLITUDES];
        Vector e[D], G[D], H[K::MODES], corners[CORNERS];
        turn(d, h, e, root, q);
        K::amplitudes(of, q, y);
        load(b, y, due);
        K::slopes(of, y, p);
        for (int k = 0; k < K::MODES; ++k) {
            H[k] = p[k * D] * e[0];
            for (int i = 1; i < D; ++i) H[k] = H[k] + p[k * D + i] * e[i];
        }
        for (int i = 0; i < D; ++i) {
            Vector pull = p[i] * h[0], share = of.share[0][i] * H[0];
            Lanes along = p[i] * q[i];
            for (int k = 1; k < K::MODES; ++k) {
                pull = pull + p[k * D + i] * h[k];
                share = share + of.share[k][i] * H[k];
                along += p[k * D + i] * q[k * D + i];
            }
            G[i] = f[i] + root[i] * (pull - along * e[i]) - share;
        }
        for (int k = 0; k < K::MODES; ++k) {
            for (int i = 0; i < D; ++i) H[k] = H[k] + of.lean[k][i] * G[i];
        }
        K::join(G, H, corners);
        for (int c = 0; c < CORNERS; ++c) store(force_of(b, c), corners[c]);
    }

    // Amplitudes become the forces of their springs, the branches that are due having relaxed.
    void load(long b, Lanes* y, unsigned due) {
        double mu = 2.0 * problem_.C10 + whole_modulus_;
        for (int m = 0; m < AMPLITUDES; ++m) {
            long at = b * AMPLITUDES + m;
            if (due) relax_mode(b, m, y[m], due);
            last_y_[at] = y[m];
            y[m] = pulling_y_[at] - mu * y[m];
        }
    }

    // Let the due branches of an amplitude relax.
    void relax_mode(long b, int m, Lanes y, unsigned due) {
        long at = b * AMPLITUDES + m;
        Lanes work = mode_work_[b], pull = pulling_y_[at], last = last_y_[at];
        for (size_t k = 0; k < branch_.size(); ++k) {
            if (!(due >> k & 1u)) continue;
            const Relaxation& branch = branch_[k];
            Lanes& r = relaxing_y_[at * branch_.size() + k];
            Lanes change = branch.share * (y + branch.behind * (last - y) - r);
            work += branch.modulus * (0.5 * (y + last) - r - 0.5 * change) * change;
            pull += branch.modulus * change;
            r += change;
        }
        mode_work_[b] = work;
        pulling_y_[at] = pull;
    }

    // Let the due branches of a block relax.
    void relax(long b, const Lanes* C_bar, unsigned due) {
        const Lanes* last = last_C_bar_[b].of;
        Lanes twice[K::COMPONENTS], met[K::COMPONENTS], change[K::COMPONENTS];
        for (int m = 0; m < K::COMPONENTS; ++m) twice[m] = C_bar[m] + last[m];
        for (size_t k = 0; k < branch_.size(); ++k) {
            if (!(due >> k & 1u)) continue;
            const Relaxation& branch = branch_[k];
            for (int m = 0; m < K::COMPONENTS; ++m) {
                met[m] = C_bar[m] + branch.behind * (last[m] - C_bar[m]);
            }
            K::adjugate(met, change);
            Lanes inverse =
                -branch.modulus / (determinant<K>(met) * reference_[b].inverse_volume);
            Lanes* viscous = relaxing_[b * branch_.size() + k].of;
            for (int m = 0; m < K::COMPONENTS; ++m) {
                change[m] = branch.share * (inverse * change[m] - viscous[m]);
                viscous[m] += change[m];
                branches_[b].of[m] += change[m];
            }
            metric_work_[b] -= 0.5 * contraction<K>(twice, change);
        }
    }

    // The tension of all ring cells at a diameter, on both its ends.
    void pull(long from, long to) {
        const char* tension = reinterpret_cast<const char*>(tension_.data());
        for (long g = from; g < to; ++g) {
            const uint32_t* slot = &tension_slot_[tension_slice_[g].first];
            double sum[LANES] = {};
            for (uint32_t k = 0; k < tension_slice_[g].degree; ++k, slot += LANES) {
                for (int i = 0; i < LANES; ++i) {
                    sum[i] += *reinterpret_cast<const double*>(tension + slot[i]);
                }
            }
            Vector f = side_by_side(sum) * direction_[g];
            Lanes* first = &corner_force_[((blocks_ + 1) * CORNERS + 2 * g) * WIDE];
            store(first, -f);
            store(first + WIDE, f);
        }
    }

    Lanes* force_of(long b, int c) { return &corner_force_[(b * CORNERS + c) * WIDE]; }

    // v += dt (f / m + g), held components excepted; and the next drift.
    void kick(long from, long to, double kick_dt, double drift_dt) {
        const char* force = reinterpret_cast<const char*>(corner_force_.data());
        Node gravity = {}, zero = {};
        for (int i = 0; i < D; ++i) gravity[i] = problem_.gravity[i];
        Node *x = position_.data(), *v = velocity_.data(), *inverse_mass = inverse_mass_.data();
        for (long q = from; q < to; ++q) {
            const uint32_t* slot = &force_slot_[force_slice_[q].first];
            Node sum[LANES] = {};
            for (uint32_t k = 0; k < force_slice_[q].degree; ++k, slot += LANES) {
                for (int i = 0; i < LANES; ++i) {
                    sum[i] += *reinterpret_cast<const Node*>(force + slot[i]);
                }
            }
            for (int i = 0; i < LANES; ++i) {
                long k = q * LANES + i;
                Node weight = inverse_mass[k] > 0.0 ? gravity : zero;
                Node now = v[k] + kick_dt * (sum[i] * inverse_mass[k] + weight);
                v[k] = now;
                x[k] += drift_dt * now;
            }
        }
    }

    // Compression, and what bulk viscosity has dissipated.
    void add_volumetric(Energies& sum) {
        for (long k = 0; k < pressure_slices() * LANES; ++k) {
            long q = k / LANES;
            int lane = int(k % LANES);
            if (pressure_at()[k] < 0) continue;
            double all = 1.0 / inverse_whole_[q][lane];  // of its elements
            double dilation = J_[q][lane] - 1.0;
            sum.stored += 0.5 * problem_.bulk_modulus * dilation * dilation * all / SHARES;
            sum.dissipated += 0.5 * bulk_work_[q][lane] * all;
        }
    }

    // The springs of one element's hourglass modes.
    void add_bending(Energies& sum, long b, int lane, const Vector* d, const Vector* h) {
        Lanes root[D], q[AMPLITUDES], y[AMPLITUDES];
        Vector e[D];
        turn(d, h, e, root, q);
        K::amplitudes(modes_[b], q, y);
        for (int m = 0; m < AMPLITUDES; ++m) {
            sum.stored += problem_.C10 * y[m][lane] * y[m][lane];
            for (size_t k = 0; k < branch_.size(); ++k) {
                Lanes relaxed = relaxing_y_[(b * AMPLITUDES + m) * branch_.size() + k];
                double stretch = y[m][lane] - relaxed[lane];
                sum.stored += 0.5 * branch_[k].modulus * stretch * stretch;
            }
        }
        sum.dissipated += mode_work_[b][lane];
    }

    // Law and Maxwell branches of one element.
    void add_isochoric(Energies& sum, long b, int lane) {
        Lanes C[K::COMPONENTS];
        Vector d[D], bent[K::MODES + 1];
        deform(b, d, bent);
        if constexpr (HAS_MODES) add_bending(sum, b, lane, d, bent);
        stretch(b, d, C);
        double volume = 1.0 / reference_[b].inverse_volume[lane];
        double J = (K::volume(d) * scale_at_rest(b) * hoop(b))[lane] / volume;
        double r2 = 1.0 / std::cbrt(J * J);
        double k1 = r2 * first_invariant(reference_[b], C)[lane] - 3.0;
        sum.stored += volume * k1 * (problem_.C10 + k1 * (problem_.C20 + k1 * problem_.C30));
        if (!branch_.empty()) sum.dissipated -= 0.5 * metric_work_[b][lane];
        double det_D = volume / scale_at_rest(b)[lane];
        for (size_t k = 0; k < branch_.size(); ++k) {
            double A[K::COMPONENTS], C_bar[K::COMPONENTS], stiffness = branch_[k].modulus * volume;
            for (int m = 0; m < K::COMPONENTS; ++m) {
                A[m] = -relaxing_[b * branch_.size() + k].of[m][lane] / stiffness;
                C_bar[m] = r2 * C[m][lane];
            }
            double logarithm = std::log(determinant<K>(A) * det_D * det_D);  // det I = det_D^-2
            sum.stored += 0.5 * stiffness * (contraction<K>(A, C_bar) - 3.0 - logarithm);
            sum.dissipated += 0.5 * stiffness * logarithm;
        }
    }
};

template <class K>
int solve(const Problem& p, int threads, long increments, long repeats, const char* positions) {
    Solver<K> solver(p, threads);
    std::vector<double> seconds;
    std::vector<std::thread> others;
    for (int t = 1; t < threads; ++t) {
        others.emplace_back([&, t] { solver.run(t, increments, repeats, seconds); });
    }
    solver.run(0, increments, repeats, seconds);
    for (auto& thread : others) thread.join();

    Energies energy = solver.energies();
    if (!std::isfinite(energy.kinetic + energy.stored + energy.dissipated)) {
        std::fprintf(stderr, "energies are not finite after %ld increments of %g s\n",
                     increments * repeats, p.dt);
        return 1;
    }
    std::sort(seconds.begin(), seconds.end());
    double updates = double(p.cells) * double(increments);
    std::printf("{\"best\": %.6g, \"median\": %.6g, \"kinetic_energy\": %.17g, ",
                updates / seconds.front(), updates / seconds[seconds.size() / 2], energy.kinetic);
    std::printf("\"stored_energy\": %.17g, \"dissipated_energy\": %.17g}\n", energy.stored,
                energy.dissipated);
    if (positions) {
        std::vector<double> x = solver.positions();
        std::ofstream file(positions, std::ios::binary);
        file.write(reinterpret_cast<const char*>(x.data()), std::streamsize(x.size() * sizeof x[0]));
    }
    return 0;
}

int main(int argc, char** argv) {
    if (argc < 5) {
        std::fprintf(stderr, "usage: reference INPUT THREADS INCREMENTS REPEATS [POSITIONS]\n");
        return 2;
    }
    Problem problem = read_problem(argv[1]);
    int threads = std::atoi(argv[2]);
    long increments = std::atol(argv[3]), repeats = std::atol(argv[4]);
    const char* positions = argc > 5 ? argv[5] : nullptr;
    if (threads < 1 || increments < 1 || repeats < 1) {
        std::fprintf(stderr, "threads, increments and repeats are at least 1\n");
        return 2;
    }
    bool has_modes = problem.mode_numbers > 0;
    auto run = problem.dimension == 3 ? (has_modes ? solve<Hexahedron> : solve<Solid>)
               : problem.has_rings    ? solve<RingSection>
               : has_modes            ? solve<Quadrilateral>
                                      : solve<PlaneStrain>;
    return run(problem, threads, increments, repeats, positions);
}
