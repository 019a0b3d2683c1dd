// Backward differences of variable order: orders for uneven steps, starts, what is remembered, what is refused.
#include <gtest/gtest.h>

#include "common/result/record.hpp"
#include "motion.hpp"
#include "tests/support/message_of.hpp"

namespace tubule::surface3d::bdf_test {

constexpr Scheme bdf = scheme_named("bdf");
const Sphere wavy{.radius = 1, .modes = {{0.2, 2, 1}, {0.1, 3, 2}}};
const Bending energy{.k = {0.125, 0, 0.05}, .H0 = 0};

Motion moving(ModelKind kind, int order) {
    const double gamma = kind == ModelKind::overdamped ? 1 : 0.3;
    return {mesh_of(wavy, icosphere(2), order),
            {.kind = kind, .Re = 1, .gamma = gamma, .keeps_volume = {}},
            energy,
            {},
            bdf};
}

// Energy, a moment of the shape, which depends on positions alone, lambda.
Eigen::Vector3d seen(Motion& motion) {
    const auto moment = [](const Eigen::Vector3d& x) { return std::pow(x.squaredNorm(), 2) + x.x() * x.z(); };
    return {motion.measures().bending.energy, integral(motion.mesh(), moment), motion.state.lambda};
}

// In steps that grow from a very short one, as in a run, to `longest`.
void start(Motion& motion, double end, double longest) {
    const double first = 1e-6;
    for (double tau = first; motion.state.time < end * (1 - 1e-9); tau = std::min(1.3 * tau, longest)) {
        const double left = end - motion.state.time;
        motion.steps(left < tau ? left : left < 2 * tau ? left / 2 : tau, 1);
    }
}

TEST(Bdf, IsOfFourthOrderForUnevenSteps) {
    // Against itself in steps a quarter as long as the shortest: from one state, with steps in turn short and 1.5 times
    // as long. Order 4 makes 16 of a factor of 2; of the energy a few 1e-7 remain, since nodes lie elsewhere.
    Motion motion = moving(ModelKind::overdamped, 4);
    const double begin = 0.02, end = 0.25;
    const Extent kept = extent(motion.surface.space(), motion.mesh());
    start(motion, begin, (end - begin) / 128);
    const MotionState from = motion.state;
    const auto at_end = [&](int pairs) {
        motion.state = from;
        const double pair = (end - begin) / pairs;
        double before = motion.measures().bending.energy;
        for (int i = 0; i < pairs; ++i)
            for (const double tau : {0.4 * pair, 0.6 * pair}) {
                motion.steps(tau, 1);
                const double now = motion.measures().bending.energy;
                EXPECT_LT(now, before) << motion.state.time;
                before = now;
            }
        const Extent e = extent(motion.surface.space(), motion.mesh());
        EXPECT_NEAR(e.area / kept.area, 1, 1e-8);
        EXPECT_NEAR(e.volume / kept.volume, 1, 1e-8);
        return seen(motion);
    };
    const Eigen::Vector3d coarse = at_end(6), fine = at_end(12), finest = at_end(24);
    for (int i : {0, 1, 2}) {
        EXPECT_GT(std::abs(coarse[i] - finest[i]) / std::abs(fine[i] - finest[i]), i == 0 ? 5 : 13) << i;
        EXPECT_LT(std::abs(fine[i] / finest[i] - 1), i < 2 ? 1e-7 : 1e-4) << i;
    }
    EXPECT_EQ(motion.scheme->step(motion.state, 1e-3).order, 4);
}

TEST(Bdf, StartsWithLittleError) {
    // Radius of a sphere without k20, theory.md (6.4), in closed form: R^6 = 1 + 12 (k42 + 16 k40) t, in steps that
    // grow by 1.3 from a very short first one. Steps of second order leave 2e-5.
    const double end = 0.4, exact = std::pow(1 + 12 * 0.42 * end, 1.0 / 6);
    Motion motion(mesh_of(Sphere{}, icosphere(2), 4), {}, {.k = {0, 0.02, 0.1}, .H0 = 0}, {}, bdf);
    start(motion, end, 0.02);
    const double radius = std::sqrt(integral(motion.mesh(), [](const auto&) { return 1.0; }) / (4 * pi));
    EXPECT_NEAR(radius, exact, 2e-6);
}

TEST(Bdf, GoesOnFromARecordAsIfNothingHadBeen) {
    // After each of the first steps, which remember more and more.
    for (const ModelKind kind : {ModelKind::gradient_flow, ModelKind::stokes}) {
        Motion motion = moving(kind, 2);
        for (int i = 0; i < 8; ++i) {
            motion.steps(1e-4 * (1 + 0.1 * i), 1);
            Record record;
            RecordWriter writer(record);
            motion.state.memory->save(writer, motion.state);
            MotionState resumed = motion.state;
            resumed.memory = restored_memory(bdf, RecordReader(record), resumed);
            const MotionStep a = motion.scheme->step(motion.state, 2e-4), b = motion.scheme->step(resumed, 2e-4);
            EXPECT_EQ(a.state.X, b.state.X) << i;
            EXPECT_EQ(a.state.u, b.state.u) << i;
            EXPECT_EQ(a.error, b.error) << i;
            EXPECT_EQ(a.order, b.order) << i;
        }
    }
}

TEST(Bdf, EstimatesTheErrorOfItsSteps) {
    // Against ten steps in place of one, along the normal, at the order that the start has come to.
    Motion motion = moving(ModelKind::gradient_flow, 4);
    start(motion, 0.05, 2e-3);
    const MotionState from = motion.state;
    const double tau = 4e-3;
    const MotionStep whole = motion.scheme->step(from, tau);
    motion.steps(tau / 10, 10);
    const VectorField& normal = motion.measures().fields.normal;
    const double error = (whole.state.X - motion.state.X).cwiseProduct(normal).colwise().sum().cwiseAbs().maxCoeff();
    EXPECT_GE(whole.order, 3);
    EXPECT_GT(whole.error, error / 3) << error;
    EXPECT_LT(whole.error, error * 3) << error;
}

TEST(Bdf, RefusesInertia) {
    // Backward differences of order 3 and 4 are not A-stable: bending waves grow.
    EXPECT_EQ(test::message_of<std::invalid_argument>([&] { moving(ModelKind::fluid, 2); }),
              "scheme bdf is for models without inertia: bending waves grow in its steps");
}

}  // namespace tubule::surface3d::bdf_test
