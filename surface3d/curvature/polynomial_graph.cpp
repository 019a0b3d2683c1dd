#include "surface3d/curvature/polynomial_graph.hpp"

#include <Eigen/Householder>
#include <algorithm>
#include <array>
#include <numeric>

namespace tubule::surface3d {
namespace {

// x^0 ... x^degree and the first two derivatives.
struct Powers {
    double v[max_graph_degree + 1], d[max_graph_degree + 1], dd[max_graph_degree + 1];

    Powers(double x, int degree) {
        v[0] = 1, d[0] = 0, dd[0] = 0;
        for (int i = 1; i <= degree; ++i) {
            v[i] = v[i - 1] * x;
            d[i] = i * v[i - 1];
            dd[i] = i * d[i - 1];
        }
    }
};

using Coefficients = Eigen::Matrix<double, graph_coefficients(max_graph_degree), 1>;

// min |A x - b| by Householder reflections with pivoting by columns; A and b are overwritten. Eigen's own would
// allocate for every fit.
Coefficients least_squares(Eigen::Ref<Eigen::MatrixXd> A, Eigen::Ref<Eigen::VectorXd> b, double* workspace) {
    const auto n = A.cols(), steps = std::min(A.rows(), A.cols());
    std::array<Eigen::Index, graph_coefficients(max_graph_degree)> column;
    std::iota(column.begin(), column.end(), 0);
    Coefficients norm2;  // of what is left of each column, and what that was when last computed afresh
    Coefficients fresh;
    for (Eigen::Index j = 0; j < n; ++j) norm2[j] = fresh[j] = A.col(j).squaredNorm();
    const double rank_limit = 1e-24 * norm2.head(n).maxCoeff();
    Eigen::Index rank = 0;
    for (; rank < steps; ++rank) {
        Eigen::Index pivot;
        if (norm2.segment(rank, n - rank).maxCoeff(&pivot) <= rank_limit) break;
        pivot += rank;
        if (pivot != rank) {
            A.col(rank).swap(A.col(pivot));
            std::swap(column[rank], column[pivot]);
            norm2[pivot] = norm2[rank], fresh[pivot] = fresh[rank];
        }
        const auto below = A.rows() - rank;
        double tau, beta;
        A.col(rank).tail(below).makeHouseholderInPlace(tau, beta);
        A(rank, rank) = beta;
        const auto essential = A.col(rank).tail(below - 1);
        if (rank + 1 < n) A.bottomRightCorner(below, n - rank - 1).applyHouseholderOnTheLeft(essential, tau, workspace);
        b.tail(below).applyHouseholderOnTheLeft(essential, tau, workspace);
        for (Eigen::Index j = rank + 1; j < n; ++j) {
            norm2[j] -= A(rank, j) * A(rank, j);
            if (norm2[j] < 1e-6 * fresh[j]) norm2[j] = fresh[j] = A.col(j).tail(below - 1).squaredNorm();
        }
    }
    A.topLeftCorner(rank, rank).triangularView<Eigen::Upper>().solveInPlace(b.head(rank));
    Coefficients x = Coefficients::Zero();
    for (Eigen::Index j = 0; j < rank; ++j) x[column[j]] = b[j];
    return x;
}

}  // namespace

SurfacePoint<double> PolynomialGraph::at(const Eigen::Vector3d& position) const {
    const Eigen::Vector3d d = (position - origin) / scale;
    const Powers x(d.dot(e1), degree), y(d.dot(e2), degree);
    double h = 0, hx = 0, hy = 0, hxx = 0, hxy = 0, hyy = 0;
    for (int i = 0, n = 0; i <= degree; ++i) {
        double p = 0, py = 0, pyy = 0;
        for (int j = 0; i + j <= degree; ++j, ++n) {
            const double c = coefficient[n];
            p += c * y.v[j], py += c * y.d[j], pyy += c * y.dd[j];
        }
        h += x.v[i] * p, hx += x.d[i] * p, hy += x.v[i] * py;
        hxx += x.dd[i] * p, hxy += x.d[i] * py, hyy += x.v[i] * pyy;
    }
    SurfacePoint<double> p;
    const Eigen::Vector3d X = origin + scale * (x.v[1] * e1 + y.v[1] * e2 + h * normal);
    set_tangents<double>(p, X, e1 + hx * normal, e2 + hy * normal);
    set_curvature<double>(p, normal * (hxx / scale), normal * (hxy / scale), normal * (hyy / scale));
    return p;
}

GraphFit::GraphFit(int degree, int max_points)
    : degree_(degree),
      storage_(max_points, graph_coefficients(degree)),
      heights_(max_points),
      workspace_(graph_coefficients(degree)) {}

PolynomialGraph GraphFit::operator()(const Eigen::Vector3d& origin, const Eigen::Vector3d& normal,
                                     const Eigen::Ref<const Eigen::Matrix3Xd>& points) {
    PolynomialGraph graph{degree_, origin, {}, {}, normal, 0, {}};
    graph.e1 = normal.unitOrthogonal();
    graph.e2 = normal.cross(graph.e1);
    for (Eigen::Index r = 0; r < points.cols(); ++r)
        graph.scale = std::max(graph.scale, (points.col(r) - origin).norm());

    // The columns of a matrix with just these rows lie one after the other.
    Eigen::Map<Eigen::MatrixXd> rows(storage_.data(), points.cols(), storage_.cols());
    for (Eigen::Index r = 0; r < points.cols(); ++r) {
        const Eigen::Vector3d d = (points.col(r) - origin) / graph.scale;
        const Powers x(d.dot(graph.e1), degree_), y(d.dot(graph.e2), degree_);
        for (int i = 0, column = 0; i <= degree_; ++i)
            for (int j = 0; i + j <= degree_; ++j, ++column) rows(r, column) = x.v[i] * y.v[j];
        heights_[r] = d.dot(normal);
    }
    graph.coefficient = least_squares(rows, heights_.head(points.cols()), workspace_.data());
    return graph;
}

}  // namespace tubule::surface3d
