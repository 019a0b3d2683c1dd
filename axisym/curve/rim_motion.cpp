// What CurveMotion adds where a patch ends in rings: the forces that hold them, and membrane that flows through open
// ones.
#include "axisym/curve/curve_motion.hpp"

namespace tubule::axisym {

void CurveMotion::hold_rings(const Eigen::VectorXd& x) {
    const std::vector<Ring> rings = rings_of(space(), x, law_.rim);
    rim_ = rim_functionals(space(), rings);
    rim_values_ = rim_.transpose() * x;
    if (law_.beads) beads_.emplace(space(), law_.beads->width, rings.front().z);
}

// The forces that hold the ends of a patch, and the conditions that they belong to.
void CurveMotion::hold_rim(double t, const double* y, double* F) const {
    using Vector = Eigen::VectorXd;
    const Eigen::Index n = rim_.rows(), count = rim_.cols();
    const auto hold = [&](int field, int number) {
        Eigen::Map<Vector>(F + field, n) += rim_ * Eigen::Map<const Vector>(y + number, count);
        Eigen::Map<Vector>(F + number, count) = rim_.transpose() * Eigen::Map<const Vector>(y + field, n);
    };
    hold(0, at_.rim);
    Eigen::Map<Vector>(F + at_.rim, count) -= rim_values_;
    if (law_.open_rim)
        hold_open_rim(t, y, F);
    else if (at_.rim_flow >= 0)
        hold(at_.u_r, at_.rim_flow);
}

void CurveMotion::hold_open_rim(double t, const double* y, double* F) const {
    const Eigen::Map<const Eigen::VectorXd> x(y, space().size()), u(y + at_.u_r, space().size());
    Eigen::Map<Eigen::VectorXd> rows(F + at_.u_r, space().size());
    int number = at_.rim_flow;
    for (const OpenRim& rim : open_rims_) {
        for (const Eigen::SparseMatrix<double>& B : rim.conditions()) {
            F[number] = x.dot(B * u);
            rows += y[number] * (B.transpose() * x);
            ++number;
        }
        const OpenRim::Pull pull = rim.pull(forms_.bending(), law_.tension.at(t), y);
        for (int i = 0; i < 2; ++i) rows[pull.rows[i]] += pull.values[i];
        const OpenRim::VolumeAtEnd volume = rim.volume_at_end(y);
        rows[volume.z] -= force_weights(t, y).volume * volume.by_z;
        if (law_.keeps_volume) F[at_.lambda] -= volume.by_z * u[volume.z];
    }
}

void CurveMotion::add_open_rim(double t, const double* y, double* values) const {
    const int n = space().size();
    const Eigen::Map<const Eigen::VectorXd> x(y, n), u(y + at_.u_r, n);
    int number = at_.rim_flow;
    for (const OpenRim& rim : open_rims_) {
        for (const Eigen::SparseMatrix<double>& B : rim.conditions()) {
            const Eigen::VectorXd by_u = B.transpose() * x, by_x = B * u;
            const std::vector<int>& row = number_rows_.at(number);
            double* column = values + pattern_.outerIndexPtr()[number];
            for (int i = 0; i < n; ++i) {
                values[row[i]] += by_x[i], values[row[at_.u_r + i]] += by_u[i];
                column[at_.u_r + i] += by_u[i];
            }
            for (int j = 0; j < n; ++j)
                for (Eigen::SparseMatrix<double>::InnerIterator it(B, j); it; ++it)
                    values[slot_of(at_.u_r + j, static_cast<int>(it.row()))] += y[number] * it.value();
            ++number;
        }
        const OpenRim::Pull pull = rim.pull(forms_.bending(), law_.tension.at(t), y);
        for (int i = 0; i < 2; ++i)
            for (std::size_t k = 0; k < pull.columns.size(); ++k)
                values[slot_of(at_.u_r + pull.rows[i], pull.columns[k])] +=
                    pull.slopes(i, static_cast<Eigen::Index>(k));
        const OpenRim::VolumeAtEnd volume = rim.volume_at_end(y);
        values[slot_of(at_.u_r + volume.z, volume.r)] -= force_weights(t, y).volume * volume.by_z_r;
        if (at_.lambda < 0) continue;
        values[slot_of(at_.u_r + volume.z, at_.lambda)] -= volume.by_z;
        if (!law_.keeps_volume) continue;
        values[slot_of(at_.lambda, at_.u_r + volume.z)] -= volume.by_z;
        values[slot_of(at_.lambda, volume.r)] -= volume.by_z_r * u[volume.z];
    }
}

// Kinetic energy that membrane brings through open rims, per time.
double CurveMotion::rim_supply(const double* y) const {
    double sum = 0;
    for (const OpenRim& rim : open_rims_) {
        const auto [out, square] = rim.outflow(y, y + at_.u_r);
        sum -= law_.inertia / 2 * square * out;
    }
    return sum;
}

void CurveMotion::add_rim(double t, const double* y, double* values) const {
    const auto n = static_cast<int>(rim_.rows());
    const auto add = [&](int field, int number) {
        const std::vector<int>& row = number_rows_.at(number);
        double* column = values + pattern_.outerIndexPtr()[number];
        const int condition = number - (field == 0 ? at_.rim : at_.rim_flow);
        for (int i = 0; i < n; ++i)
            column[field + i] += rim_(i, condition), values[row[field + i]] += rim_(i, condition);
    };
    for (int k = 0; k < rim_.cols(); ++k) {
        add(0, at_.rim + k);
        if (at_.rim_flow >= 0 && !law_.open_rim) add(at_.u_r, at_.rim_flow + k);
    }
    if (law_.open_rim) add_open_rim(t, y, values);
}

}  // namespace tubule::axisym
