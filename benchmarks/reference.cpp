// The ceiling: softsim's bare explicit increment, written by hand for one processor.
//
//     reference INPUT THREADS INCREMENTS REPEATS [POSITIONS]
//
// INPUT is written by ceiling.py (layout: `read_problem` below). Prints its rate as JSON; writes
// the final positions to POSITIONS. One increment is
//     x += dt v                                             drift
//     J_a = sum V_e / sum V_e0,  p_a = kappa (J_a - 1) + b_a dJ_a/dt      averaged nodal pressure
//     P = J^(-2/3) 2 W' (F - I1/3 F^-T) + p_e J F^-T,  f_a = -V P grad N_a   Yeoh, corner forces
//     v += dt (f / m + g)                                   kick
// on plane-strain triangles or tetrahedra: the equations of softsim/elements, without Maxwell
// branches, contact, loads, rigid bodies and energies.
//
// What made it fast (AVX-512, Zen 4; share of the increment before each):
// * Lanes: eight elements at a time, corner data gathered whole nodes at a load.
// * No F. With D the edges x_c - x_0 and G the gradients of corners 1..d,
//     V P grad N_c = a sum_k M_ck d_k + h dV/dx_c,  M = V G G^T,  I1 = M : (D^T D) / V,
//   four numbers of reference geometry a triangle instead of five, seven a tetrahedron, not ten.
// * No serial sums of forces into nodes, whose additions wait for one another (half the rate):
//   elements write their corners' shares side by side, nodes collect theirs. Eight nodes of one
//   slice collect in lock step; slices are sorted by how many elements a node has, and padded by
//   an empty slot, so no branch is mispredicted.
// * One sweep over the mesh does an increment. Nodes and elements lie in a band, so pressure,
//   stress and kick follow close behind the volumes that they wait for, in the cache.
// * Two threads: each sweeps its half towards the common interface, which is done between barriers.
// * Huge pages.

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
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

constexpr int LANES = 8;
using Pair = double __attribute__((vector_size(16)));
using Quad = double __attribute__((vector_size(32)));
using Lanes = double __attribute__((vector_size(64)));

// --- eight vectors side by side ------------------------------------------------------------------

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
inline Plane operator*(Lanes s, Plane a) { return {s * a.x, s * a.y}; }
inline Space operator*(Lanes s, Space a) { return {s * a.x, s * a.y, s * a.z}; }
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
inline Lanes joined(Quad a, Quad b) {
#ifdef __AVX512F__
    return _mm512_insertf64x4(_mm512_castpd256_pd512(a), b, 1);
#else
    return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7);
#endif
}

using Corner = std::array<int32_t, LANES>;  // the node at one corner of eight elements

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

inline Lanes side_by_side(const double* s) {
    return Lanes{s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7]};
}

// Eight vectors one after the other: x y x y ..., or x y z 0 x y z 0 ...
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

// As in softsim/elements/tensors.py.
inline Lanes inverse_cube_root(Lanes J) {
    Lanes d = J - 1.0, third = J * (1.0 / 3.0);
    Lanes y = 1.0 + d * (d * (2.0 / 9.0) - 1.0 / 3.0);
    for (int k = 0; k < 3; ++k) y = y * (4.0 / 3.0 - (third * y) * (y * y));
    return y;
}

// --- what depends on the dimension ---------------------------------------------------------------

template <int D>
struct Kind;

template <>
struct Kind<2> {
    using Node = Pair;
    using Vector = Plane;
    static constexpr int METRIC[2][2] = {{0, 1}, {1, 2}};  // index of M_ck among the stored ones
    static constexpr double ACROSS = 1.0;                  // share of F_zz = 1 in I1
    // Volume of each element over `measure` = thickness / 2, and its derivative by corner 1, 2.
    static Lanes volume(const Plane* d) { return d[0].x * d[1].y - d[0].y * d[1].x; }
    static Lanes volume(const Plane* d, Plane* slope) {
        slope[0] = {d[1].y, -d[1].x};
        slope[1] = {-d[0].y, d[0].x};
        return volume(d);
    }
};

template <>
struct Kind<3> {
    using Node = Quad;
    using Vector = Space;
    static constexpr int METRIC[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    static constexpr double ACROSS = 0.0;
    // `measure` is 1/6.
    static Lanes volume(const Space* d) { return dot(d[0], cross(d[1], d[2])); }
    static Lanes volume(const Space* d, Space* slope) {
        slope[0] = cross(d[1], d[2]);
        slope[1] = cross(d[2], d[0]);
        slope[2] = cross(d[0], d[1]);
        return dot(d[0], slope[0]);
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

struct Problem {
    int64_t dimension, nodes, cells;
    double thickness, dt, bulk_modulus, C10, C20, C30;
    std::vector<double> gravity;                              // (d)
    std::vector<double> points, position, velocity;           // (nodes, d)
    std::vector<double> inverse_mass;                         // (nodes, d), zero where held
    std::vector<double> bulk_viscosity;                       // (nodes) b_a [Pa s]
    std::vector<int32_t> corner;                              // (cells, d + 1), in a band
};

Problem read_problem(const char* path) {
    std::ifstream file(path, std::ios::binary);
    Problem p;
    auto read = [&](auto* to, size_t count) {
        file.read(reinterpret_cast<char*>(to), std::streamsize(count * sizeof *to));
    };
    read(&p.dimension, 3);
    read(&p.thickness, 6);
    size_t d = size_t(p.dimension), n = size_t(p.nodes);
    auto numbers = [&](std::vector<double>& to, size_t count) {
        to.resize(count);
        read(to.data(), count);
    };
    numbers(p.gravity, d);
    for (auto* a : {&p.points, &p.position, &p.velocity, &p.inverse_mass}) numbers(*a, n * d);
    numbers(p.bulk_viscosity, n);
    p.corner.resize(size_t(p.cells) * (d + 1));
    read(p.corner.data(), p.corner.size());
    if (!file) {
        std::fprintf(stderr, "cannot read %s\n", path);
        std::exit(2);
    }
    return p;
}

// --- where everything lies -----------------------------------------------------------------------

// The elements and nodes of one thread. Its elements lie in [first_block, end_block), its nodes in
// slices of eight, those that only it touches first.
struct Part {
    long first_block, end_block, first_slice, shared_slice, end_slice;
};

struct Layout {
    std::vector<Part> parts;
    std::vector<long> cell_at;  // by (block, lane): the cell, -1 where there is none
    std::vector<long> node_at;  // by (slice, lane): the node, -1 where there is none
};

constexpr long WINDOW = 64;  // nodes sorted by how many elements they have

// Cells come in the order of their lowest nodes, which are numbered for a narrow band. Every other thread goes through its share backwards, so that
// two threads meet at their interface at the end.
Layout lay_out(const Problem& p, long threads) {
    long corners = p.dimension + 1;
    Layout layout;
    std::vector<long> last(p.nodes, -1), owner(p.nodes, -1), degree(p.nodes, 0);
    std::vector<bool> shared(p.nodes, false);
    for (long t = 0; t < threads; ++t) {
        long from = p.cells * t / threads, to = p.cells * (t + 1) / threads;
        long first = long(layout.cell_at.size());
        for (long k = 0; k < to - from; ++k) layout.cell_at.push_back(t % 2 ? to - 1 - k : from + k);
        for (size_t e = size_t(first); e < layout.cell_at.size(); ++e) {
            for (long c = 0; c < corners; ++c) {
                int32_t a = p.corner[layout.cell_at[e] * corners + c];
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

// --- the increment -------------------------------------------------------------------------------

template <int D>
class Solver {
    using Node = typename Kind<D>::Node;
    using Vector = typename Kind<D>::Vector;
    static constexpr int CORNERS = D + 1, METRICS = D * (D + 1) / 2, SLOT = sizeof(Node);

    struct Reference {
        Lanes metric[METRICS];  // -M_ck = -V grad N_c . grad N_k, the sign that forces want
        Lanes inverse_volume;
    };
    struct Edges {
        Vector d[D];
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
    long blocks_, slices_;
    double measure_;
    std::vector<Corner> corner_;  // (blocks, corners)
    Array<Reference> reference_;
    Array<Edges> edges_;
    Array<Lanes> volume_;       // of elements, by block
    Array<Lanes> corner_force_;  // (blocks, corners, lanes) of nodes' vectors
    std::vector<Slice> slice_;
    std::vector<uint32_t> volume_slot_, force_slot_;  // byte offsets
    Array<Node> position_, velocity_, inverse_mass_;
    Array<Lanes> J_, pressure_, inverse_node_volume_, viscosity_;  // of nodes, by slice
    std::vector<std::vector<Stage>> plan_;
    Barrier barrier_;

  public:
    Solver(const Problem& p, int threads)
        : problem_(p),
          layout_(lay_out(p, threads)),
          blocks_(long(layout_.cell_at.size()) / LANES),
          slices_(long(layout_.node_at.size()) / LANES),
          measure_(D == 2 ? 0.5 * p.thickness : 1.0 / 6.0),
          corner_(blocks_ * CORNERS),
          reference_(blocks_),
          edges_(blocks_),
          volume_(blocks_ + 1),
          corner_force_((blocks_ + 1) * CORNERS * SLOT / sizeof(double)),
          position_((slices_ + 1) * LANES),
          velocity_((slices_ + 1) * LANES),
          inverse_mass_((slices_ + 1) * LANES),
          J_(slices_),
          pressure_(slices_ + 1),
          inverse_node_volume_(slices_),
          viscosity_(slices_),
          barrier_(threads) {
        place_nodes();
        place_elements();
        for (const Part& part : layout_.parts) plan_.push_back(planned(part));
    }

    // Forces at the start and half a kick, then `repeats` times `increments` increments; run by
    // every thread. Takes the seconds of each repeat.
    void run(int thread, long increments, long repeats, std::vector<double>& seconds) {
        double dt = problem_.dt;
        increment(thread, 0.5 * dt, 0.0);
        for (long r = 0; r < repeats; ++r) {
            auto start = std::chrono::steady_clock::now();
            drift(layout_.parts[thread], dt);
            barrier_.wait();
            // The drift of the next increment rides on the kick.
            for (long k = 0; k < increments; ++k) {
                increment(thread, dt, k + 1 < increments ? dt : 0.0);
            }
            std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
            if (thread == 0) seconds.push_back(took.count());
        }
    }

    std::vector<double> positions() { return unplaced(position_); }
    std::vector<double> velocities() { return unplaced(velocity_); }

  private:
    void place_nodes() {
        const Problem& p = problem_;
        for (long k = 0; k < slices_ * LANES; ++k) {
            long a = layout_.node_at[k];
            J_[k / LANES][k % LANES] = 1.0;
            if (a < 0) continue;
            for (int i = 0; i < D; ++i) {
                position_[k][i] = p.position[a * D + i];
                velocity_[k][i] = p.velocity[a * D + i];
                inverse_mass_[k][i] = p.inverse_mass[a * D + i];
            }
            viscosity_[k / LANES][k % LANES] = p.bulk_viscosity[a];
        }
    }

    void place_elements() {
        const Problem& p = problem_;
        std::vector<long> place(p.nodes);
        for (long k = 0; k < slices_ * LANES; ++k) {
            if (layout_.node_at[k] >= 0) place[layout_.node_at[k]] = k;
        }
        struct Use {
            long block;
            int corner, lane;
        };
        std::vector<std::vector<Use>> uses(slices_ * LANES);
        std::vector<double> node_volume(slices_ * LANES, 0.0);
        long nowhere = slices_ * LANES;  // a node at the origin, for lanes without an element
        for (long e = 0; e < blocks_ * LANES; ++e) {
            long cell = layout_.cell_at[e], b = e / LANES;
            int lane = int(e % LANES);
            for (int c = 0; c < CORNERS; ++c) {
                long k = cell < 0 ? nowhere : place[p.corner[cell * CORNERS + c]];
                corner_[b * CORNERS + c][lane] = int32_t(k);
                if (cell >= 0) uses[k].push_back({b, c, lane});
            }
            if (cell < 0) continue;
            double volume = set_reference(b, lane, &p.corner[cell * CORNERS]);
            for (int c = 0; c < CORNERS; ++c) {
                node_volume[corner_[b * CORNERS + c][lane]] += volume / CORNERS;
            }
        }
        long empty = blocks_;  // a block that stays zero
        for (long q = 0; q < slices_; ++q) {
            size_t degree = 0;
            for (int i = 0; i < LANES; ++i) degree = std::max(degree, uses[q * LANES + i].size());
            slice_.push_back({uint32_t(volume_slot_.size()), uint32_t(degree)});
            for (size_t k = 0; k < degree; ++k) {
                for (int i = 0; i < LANES; ++i) {
                    const auto& mine = uses[q * LANES + i];
                    Use use = k < mine.size() ? mine[k] : Use{empty, 0, 0};
                    volume_slot_.push_back((use.block * LANES + use.lane) * sizeof(double));
                    long slot = (use.block * CORNERS + use.corner) * LANES + use.lane;
                    force_slot_.push_back(uint32_t(slot * SLOT));
                }
            }
            for (int i = 0; i < LANES; ++i) {
                double volume = node_volume[q * LANES + i];
                // A share 1 / CORNERS of each element's volume is the node's.
                inverse_node_volume_[q][i] = volume > 0.0 ? 1.0 / (CORNERS * volume) : 0.0;
            }
        }
    }

    double set_reference(long b, int lane, const int32_t* nodes) {
        double d[D][D], grad[D][D];
        for (int c = 0; c < D; ++c) {
            for (int i = 0; i < D; ++i) {
                d[c][i] = problem_.points[nodes[c + 1] * D + i] - problem_.points[nodes[0] * D + i];
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
        double volume = det * measure_;
        for (int c = 0; c < D; ++c) {
            for (int k = c; k < D; ++k) {
                double product = 0.0;
                for (int i = 0; i < D; ++i) product += grad[c][i] * grad[k][i] / (det * det);
                reference_[b].metric[Kind<D>::METRIC[c][k]][lane] = -volume * product;
            }
        }
        reference_[b].inverse_volume[lane] = 1.0 / volume;
        return volume;
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
        while (now.measured < part.end_block) {
            now.measured = std::min(now.measured + CHUNK, part.end_block);
            long end = part.shared_slice;
            while (now.pressed < end && last_block[now.pressed] < now.measured) ++now.pressed;
            while (now.stressed < now.measured && last_slice[now.stressed] < now.pressed) {
                ++now.stressed;
            }
            while (now.kicked < now.pressed && last_block[now.kicked] < now.stressed) ++now.kicked;
            plan.push_back(now);
        }
        return plan;
    }

    void increment(int thread, double kick_dt, double drift_dt) {
        const Part& part = layout_.parts[thread];
        Stage done{part.first_block, part.first_slice, part.first_block, part.first_slice};
        for (const Stage& next : plan_[thread]) {
            measure(done.measured, next.measured);
            press(done.pressed, next.pressed);
            stress(done.stressed, next.stressed);
            kick(done.kicked, next.kicked, kick_dt, drift_dt);
            done = next;
        }
        barrier_.wait();
        press(done.pressed, part.end_slice);
        barrier_.wait();
        stress(done.stressed, part.end_block);
        barrier_.wait();
        kick(done.kicked, part.end_slice, kick_dt, drift_dt);
        barrier_.wait();
    }

    void drift(const Part& part, double dt) {
        for (long k = part.first_slice * LANES; k < part.end_slice * LANES; ++k) {
            position_[k] += dt * velocity_[k];
        }
    }

    // Edges and volumes.
    void measure(long from, long to) {
        const Node* x = position_.data();
        for (long b = from; b < to; ++b) {
            const Corner* corner = &corner_[b * CORNERS];
            Vector x0 = gather(x, corner[0]), d[D];
            for (int c = 0; c < D; ++c) {
                d[c] = gather(x, corner[c + 1]) - x0;
                edges_[b].d[c] = d[c];
            }
            volume_[b] = Kind<D>::volume(d) * measure_;
        }
    }

    // p_a / corners: the shares sum to the element's mean.
    void press(long from, long to) {
        const char* volume = reinterpret_cast<const char*>(volume_.data());
        double stiffness = problem_.bulk_modulus / CORNERS, rate = 1.0 / (CORNERS * problem_.dt);
        for (long q = from; q < to; ++q) {
            const uint32_t* slot = &volume_slot_[slice_[q].first];
            double sum[LANES] = {};
            for (uint32_t k = 0; k < slice_[q].degree; ++k, slot += LANES) {
                for (int i = 0; i < LANES; ++i) {
                    sum[i] += *reinterpret_cast<const double*>(volume + slot[i]);
                }
            }
            Lanes J = side_by_side(sum) * inverse_node_volume_[q];
            pressure_[q] = stiffness * (J - 1.0) + rate * viscosity_[q] * (J - J_[q]);
            J_[q] = J;
        }
    }

    // f_c = -(a sum_k M_ck d_k + h dV/dx_c),  a = 2 W' J^(-2/3),  h = p - a I1 / (3 J).
    void stress(long from, long to) {
        const double* p = reinterpret_cast<const double*>(pressure_.data());
        double c0 = 2.0 * problem_.C10, c1 = 4.0 * problem_.C20, c2 = 6.0 * problem_.C30;
        for (long b = from; b < to; ++b) {
            const Corner* corner = &corner_[b * CORNERS];
            double sum[LANES];
            for (int i = 0; i < LANES; ++i) {
                sum[i] = p[corner[0][i]];
                for (int c = 1; c < CORNERS; ++c) sum[i] += p[corner[c][i]];
            }
            Lanes mean = side_by_side(sum);
            Vector d[D], slope[D];
            for (int c = 0; c < D; ++c) d[c] = copied(edges_[b].d[c]);
            const Reference& reference = reference_[b];
            Lanes J = Kind<D>::volume(d, slope) * measure_ * reference.inverse_volume;
            Lanes I1 = {};
            for (int c = 0; c < D; ++c) {
                for (int k = c; k < D; ++k) {
                    Lanes part = reference.metric[Kind<D>::METRIC[c][k]] * dot(d[c], d[k]);
                    I1 += c == k ? part : 2.0 * part;
                }
            }
            I1 = Kind<D>::ACROSS - I1 * reference.inverse_volume;
            Lanes r = inverse_cube_root(J), r2 = r * r;
            Lanes k1 = r2 * I1 - 3.0;
            Lanes a = r2 * (c0 + k1 * (c1 + k1 * c2));
            Lanes h = -measure_ * (mean - a * I1 * (1.0 / 3.0) * (r2 * r));
            Vector balance;
            for (int c = 0; c < D; ++c) {
                Vector f = h * slope[c];
                for (int k = 0; k < D; ++k) {
                    f = f + (a * reference.metric[Kind<D>::METRIC[c][k]]) * d[k];
                }
                balance = c == 0 ? f : balance + f;
                store(force_of(b, c + 1), f);
            }
            store(force_of(b, 0), -balance);
        }
    }

    Lanes* force_of(long b, int c) {
        return &corner_force_[(b * CORNERS + c) * (SLOT / sizeof(double))];
    }

    // v += dt (f / m + g), held components excepted; and the next drift.
    void kick(long from, long to, double kick_dt, double drift_dt) {
        const char* force = reinterpret_cast<const char*>(corner_force_.data());
        Node gravity = {}, zero = {};
        for (int i = 0; i < D; ++i) gravity[i] = problem_.gravity[i];
        Node *x = position_.data(), *v = velocity_.data(), *inverse_mass = inverse_mass_.data();
        for (long q = from; q < to; ++q) {
            const uint32_t* slot = &force_slot_[slice_[q].first];
            Node sum[LANES] = {};
            for (uint32_t k = 0; k < slice_[q].degree; ++k, slot += LANES) {
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

    std::vector<double> unplaced(Array<Node>& values) {
        std::vector<double> result(problem_.nodes * D);
        for (long k = 0; k < slices_ * LANES; ++k) {
            long a = layout_.node_at[k];
            for (int i = 0; a >= 0 && i < D; ++i) result[a * D + i] = values[k][i];
        }
        return result;
    }
};

template <int D>
void solve(const Problem& p, int threads, long increments, long repeats, const char* positions) {
    Solver<D> solver(p, threads);
    std::vector<double> seconds;
    std::vector<std::thread> others;
    for (int t = 1; t < threads; ++t) {
        others.emplace_back([&, t] { solver.run(t, increments, repeats, seconds); });
    }
    solver.run(0, increments, repeats, seconds);
    for (auto& thread : others) thread.join();

    auto x = solver.positions(), v = solver.velocities();
    double kinetic = 0.0, squares = 0.0;
    for (size_t i = 0; i < x.size(); ++i) {
        squares += (x[i] - p.points[i]) * (x[i] - p.points[i]);
        if (p.inverse_mass[i] > 0.0) kinetic += 0.5 * v[i] * v[i] / p.inverse_mass[i];
    }
    std::sort(seconds.begin(), seconds.end());
    double updates = double(p.cells) * double(increments);
    std::printf("{\"best\": %.6g, \"median\": %.6g, \"kinetic_energy\": %.17g, ",
                updates / seconds.front(), updates / seconds[seconds.size() / 2], kinetic);
    std::printf("\"squared_displacements\": %.17g}\n", squares);
    if (positions) {
        std::ofstream file(positions, std::ios::binary);
        file.write(reinterpret_cast<const char*>(x.data()), std::streamsize(x.size() * sizeof x[0]));
    }
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
    (problem.dimension == 2 ? solve<2> : solve<3>)(problem, threads, increments, repeats, positions);
    return 0;
}
