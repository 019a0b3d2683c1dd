// Vectors of random numbers that are the same at every run.
#pragma once

#include <Eigen/Core>
#include <random>

namespace tubule::test {

// Normally distributed, with the standard deviation `size`.
inline Eigen::VectorXd random_vector(int n, double size, unsigned seed = 1) {
    std::mt19937 engine(seed);
    std::normal_distribution<double> normal;
    Eigen::VectorXd x(n);
    for (double& c : x) c = size * normal(engine);
    return x;
}

// Uniformly distributed between the two.
inline Eigen::VectorXd uniform_vector(int n, double low, double high, unsigned seed) {
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> value(low, high);
    Eigen::VectorXd x(n);
    for (double& c : x) c = value(engine);
    return x;
}

}  // namespace tubule::test
