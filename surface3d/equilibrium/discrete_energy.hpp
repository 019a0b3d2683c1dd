// A discrete bending energy of curved triangles with exact first and second derivatives, theory.md (10.22): INT f(H, K)
// over each triangle and, where two triangles meet at an angle, the terms of an interior penalty method, which make it
// consistent and stable although the surface has kinks of order h^k.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <optional>
#include <vector>

#include "common/energy/bending.hpp"
#include "surface3d/fem/group_pattern.hpp"
#include "surface3d/fem/surface_space.hpp"

namespace tubule::surface3d {

// Displacements of the nodes: w_i n_i with one number w_i each, and of a tube the stretch e z e_z.
struct Directions {
    VectorField normal;    // n_i
    bool stretch = false;  // whether there is the unknown e, after those of the nodes
};

struct EnergyValues {
    double energy = 0;                          // INT f + W, of densities and potentials of places alone
    double potential = 0, potential_force = 0;  // INT W, -INT W_z
    double area = 0, volume = 0, M = 0;
    double kinks = 0;  // INT angle^2 over all edges, times the penalty: of the order of the energy's error

    EnergyValues& operator+=(const EnergyValues& v) {
        energy += v.energy, potential += v.potential, potential_force += v.potential_force;
        area += v.area, volume += v.volume, M += v.M, kinks += v.kinks;
        return *this;
    }
};

// Derivatives of the same sums with respect to the unknowns.
struct EnergyDerivatives {
    EnergyValues values;
    Eigen::VectorXd energy, area, volume, M;
    // Second derivatives of energy + sigma area + lambda volume; among nodes, and with the stretch (else empty). Zero
    // where the first alone are asked for, at a fraction of the cost.
    Eigen::SparseMatrix<double> hessian;
    Eigen::VectorXd with_stretch;
    double stretch_twice = 0;
};

class DiscreteEnergy {
public:
    // The triangles of the mesh. The penalty belongs to this energy and to these positions; it stays until
    // set_penalty() is called again. Throws std::invalid_argument where there is a gradient term.
    DiscreteEnergy(const CurvedMesh& mesh, const Bending& bending);
    void set_penalty(const CurvedMesh& mesh, const Bending& bending);

    const SurfaceSpace& space() const { return space_; }
    // A zero matrix of the pattern of the Hessian.
    const Eigen::SparseMatrix<double>& pattern() const { return groups().zero; }

    // The sums over a mesh with these triangles; where areas differ, with an energy with_M(). H0 at the nodes, where it
    // varies.
    EnergyValues values(const CurvedMesh& mesh, const Bending& bending, const Eigen::VectorXd& H0 = {}) const;
    EnergyDerivatives derivatives(const CurvedMesh& mesh, const Directions& directions, const Bending& bending,
                                  double sigma, double lambda, const Eigen::VectorXd& H0 = {},
                                  bool second = true) const;
    // The derivatives of place_integral() in the displacements.
    Eigen::VectorXd place_slope(const CurvedMesh& mesh, const Directions& directions, const Formula& W, double P) const;
    // INT w_i w_j (n.nu)^2 dS
    Eigen::SparseMatrix<double> mass(const CurvedMesh& mesh, const Directions& directions) const;

    // Beside the least that makes elements of this order stable in theory: docs/decisions/equilibria.md
    static constexpr double penalty_factor = 4;

private:
    struct Edge {
        int cell[2], side[2];
        double penalty = 0;
    };
    // Functions at the points of a rule; and their values and derivatives, six rows a point, zeros after the last.
    struct Rule {
        Tabulation table;
        Eigen::Matrix<double, Eigen::Dynamic, max_cell_nodes + 1, Eigen::RowMajor> stacked;

        explicit Rule(Tabulation functions);
        Eigen::MatrixX3d at(const CellColumns<3>& X) const;
    };
    struct Block;
    struct EdgeSides;
    struct EdgePoint;
    struct EdgeSums;

    void find_edges();
    // The triangles of an edge are a group; made when it is first asked for, by one thread.
    const GroupPattern& groups() const;
    // Where the matrix of an edge begins, and that of a cell within one of its edges, column by column of the former.
    const int* slots_of_edge(int edge) const {
        return &groups().slots[static_cast<std::size_t>(edge) * 4 * space_.width() * space_.width()];
    }
    const int* slots_of_cell(int cell) const {
        const auto [edge, side] = edge_of_cell_[cell];
        return slots_of_edge(edge) + side * space_.width() * (2 * space_.width() + 1);
    }
    void add(const Block& block, const std::vector<int>& nodes, const int* slots, EnergyDerivatives& out) const;
    void cell_block(const CurvedMesh& mesh, const Directions& d, const Bending& bending,
                    const std::optional<Formula>& potential, double sigma, double lambda, const Eigen::VectorXd& H0,
                    int cell, Block& out) const;
    void edge_block(const CurvedMesh& mesh, const Directions& d, const Bending& bending, const Eigen::VectorXd& H0,
                    const Edge& edge, Block& out) const;
    void add_derivatives(const EdgeSides& at, const EdgePoint& p, const Bending& bending, const Bending& powers,
                         double penalty, int q, EdgeSums* second, Block& out) const;

    SurfaceSpace space_;
    Rule rule_;
    std::vector<Edge> edges_;
    std::vector<std::array<int, 2>> edge_of_cell_;  // one of its edges, and on which side of it the cell is
    // Tables at the points of each edge, along and across it, as the cell on its left sees them, and the one on its
    // right, whose side runs backwards.
    std::vector<Rule> left_, right_;
    mutable std::optional<GroupPattern> pattern_;
};

}  // namespace tubule::surface3d
