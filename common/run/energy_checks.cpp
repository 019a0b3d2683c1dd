#include "common/run/energy_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/case/read.hpp"

namespace tubule {

namespace {

// Places of keys tell which term of powers became one of the list.
std::string as_written(const Problem& c, const std::string& key) {
    const auto place = c.places.find(key);
    if (place == c.places.end()) return key;
    for (std::size_t entry = 0;; ++entry) {
        const std::string name = fmt::format("energy.term.{}.modulus", entry);
        const auto other = c.places.find(name);
        if (other == c.places.end()) return key;
        if (other->second == place->second) return name;
    }
}

}  // namespace

std::string key_of_formula(const Bending& energy) {
    for (const EnergyTerm& term : energy.terms)
        if (term.formula) return fmt::format("energy.term.{}.formula", term.entry);
    const bool by_place = std::ranges::any_of(energy.potentials, [](const Potential& p) { return !p.is_wall(); });
    return by_place ? "energy.potential" : "energy";
}

CaseError not_defined(const Problem& c, const FormulaDomain::Margin& margin, const std::string& where) {
    const std::string key = key_of_formula(c.energy);
    return complaint(c, key == "energy" && c.law.source.act() ? "model.source" : key,
                     fmt::format("must be defined on the initial shape, but at {} {}", where, words(margin)));
}

void require_defined(const Problem& c, const FormulaDomain::Margin& margin, const std::string& where) {
    if (!(margin.value > 0)) throw not_defined(c, margin, where);
}

std::string key_of_ill_posed(const Problem& c) {
    const Bending& energy = c.energy;
    std::string key;
    for (std::size_t term = 0; term < count_terms(energy); ++term) {
        Bending alone;
        if (term < n_bending_terms)
            alone.k[term] = energy.k[term];
        else
            alone.terms = {energy.terms[term - n_bending_terms]};
        if (modulus(energy, term) != 0 && symbol_may_vanish(alone))
            key = key.empty() ? as_written(c, term_key(energy, term)) : "energy";
    }
    return key.empty() ? "energy" : key;
}

void require_pressure(const Problem& c, double volume) {
    if (std::isfinite(loads_at(c.law, 0).energy(0, volume, 0))) return;
    throw complaint(
        c, "model.pressure",
        fmt::format("must be defined from V = 1, where its energy is 0, to the volume of the initial shape, "
                    "{:.6g}",
                    volume));
}

void refuse_potentials(const Problem& c, double period, double energy, double distance) {
    if (c.energy.potentials.empty()) return;
    const auto refuse = [&](const std::string& what) { throw complaint(c, "energy.potential", what); };
    for (const Potential& p : c.energy.potentials) {
        if (!(period > 0)) break;
        if (p.is_wall()) refuse("needs a closed surface where it is a wall, and the initial shape is a tube");
        require_period(c, "energy.potential", *p.formula, period);
    }
    if (!(distance > 0))
        refuse(fmt::format("must have the initial shape in front of each wall, but a point of it is {:.4g} behind one",
                           -distance));
    if (!std::isfinite(energy)) refuse("must be finite on the initial shape");
}

void require_beads(const Problem& c, bool closed, double distance) {
    const double width = c.law.beads->width;
    const auto refuse = [&](const std::string& what) { throw complaint(c, "model.bead_width", what); };
    if (!closed || !std::isfinite(distance))
        refuse("needs a closed shape with two poles on the axis, where beads pull");
    if (!(distance > 2 * width))
        refuse(fmt::format(
            "must be small beside the shape: beads of {:.4g} are {:.4g} apart, and need two widths at least", width,
            distance));
}

void refuse_to_deform(const Problem& c) {
    const std::string why =
        "would deform a sphere, a straight tube or a part of one whose area and volume are fixed, and no other shape "
        "has these: free one of them (model.area, model.volume), or begin with another shape";
    if (c.law.beads) throw complaint(c, "model.bead_width", why);
    if (!c.energy.potentials.empty()) throw complaint(c, "energy.potential", why);
    if (c.energy.H0_varies()) throw complaint_about_H0(c, why);
    if (c.law.source.act()) throw complaint(c, "model.source", why);
}

void require_period(const Problem& c, const char* key, const Formula& formula, double period) {
    for (int i = 0; i < 24; ++i) {
        const double z = 0.037 * period * (i + 1), r = 0.6 + 0.07 * i, t = 0.11 * i;
        const auto value = [&](double z) {
            const double space[]{r, -0.3 * r, z, t}, plane[]{r, z, t};
            return evaluate(formula, c.tier == Tier::surface3d ? space : plane);
        };
        const double here = value(z), next = value(z + period);
        if (std::abs(next - here) > 1e-6 * (1 + std::abs(here)))
            throw complaint(c, key,
                            fmt::format("must have the period {0:.6g} of the tube along z, but a formula is {1:.6g} at "
                                        "z = {2:.6g} and {3:.6g} at z = {4:.6g}: try functions of 2*pi*z/{0:.6g}",
                                        period, here, z, next, z + period));
    }
}

void require_periodic_sources(const Problem& c, double period) {
    const Sources& source = c.law.source;
    for (const auto& formula : {source.force[0], source.force[1], source.force[2], source.mass})
        if (formula) require_period(c, "model.source", *formula, period);
}

namespace {

constexpr double no_change = 1e-9;  // of E_ref: the shape was in equilibrium

constexpr double least_scale = 1e-6;  // of the magnitude: an energy below it has cancelled away

}  // namespace

double reference_energy(const Problem& c, double energy, double by_magnitude) {
    const std::string formula = key_of_formula(c.energy);
    if (formula != "energy" && !(std::isfinite(energy) && std::isfinite(by_magnitude)))
        throw complaint(c, formula, "must be finite on the initial shape, but it overflows there");
    if (!c.accuracy.relative_to_energy) return by_magnitude;
    if (std::abs(energy) < least_scale * by_magnitude)
        throw complaint(
            c, "accuracy.relative_to",
            fmt::format(
                "must not be \"energy\": the energy of the initial shape is {:.2g}, of terms as large as {:.4g}",
                energy, by_magnitude));
    return std::abs(energy);
}

std::string doubt_before(const Problem& c, double energy, double E_ref) {
    const double allowed = c.accuracy.energy * E_ref;
    if (!(allowed > std::abs(energy)) || !std::isfinite(allowed)) return "";
    const std::string doubt = fmt::format(
        "accuracy.energy = {:.2g} allows for an error of {:.3g}, as E_ref = {:.4g}, but the energy of the initial "
        "shape is {:.3g}",
        c.accuracy.energy, allowed, E_ref, energy);
    if (energy == 0) return doubt;
    return fmt::format("{}; set accuracy.energy below {:.1g}", doubt, std::abs(energy) / E_ref);
}

std::string doubt_after(const Problem& c, Stop stop, double start, double end, double E_ref) {
    const double allowed = c.accuracy.energy * E_ref, change = std::abs(end - start);
    if (kind_of(stop).exit_code != 0 || !(allowed > change) || change <= no_change * E_ref) return "";
    return fmt::format(
        "accuracy.energy = {:.2g} allows for an error of {:.3g}, as E_ref = {:.4g}, but the energy changed by only "
        "{:.3g}; set accuracy.energy below {:.1g}",
        c.accuracy.energy, allowed, E_ref, change, change / E_ref);
}

}  // namespace tubule
