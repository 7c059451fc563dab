// What a drop does to light: the scattering (transfer) function D(theta) of a sphere of water in geometric optics,
// after Wang et al. 2006, "Real-Time Rendering of Realistic Rain", appendices A to C.
//
// theta = 0 is light that goes straight on. D is in 1/sr and integrates to 1 over the sphere. A camera that looks along
// v sees in the drop  L(v) = integral of D(angle(omega, v)) L_env(omega) d omega,  omega pointing away from the drop.
//
// A ray that strikes at incidence gamma (refracted to beta) leaves on its n-th encounter with the surface, turned by
//   zeta_n = pi - 2 gamma - (n - 1)(pi - 2 beta),   with the power   Phi_1 = R,   Phi_n = T^2 R^(n-2),
// n = 1 reflected outside, 2 straight through, 3 the first rainbow. The paper divides by d zeta / d gamma, which puts
// poles into D (rainbows, glory). Nothing here does: all integrals run over gamma, where every factor is smooth.
//
// No diffraction (half the extinction of a large drop, within a thousandth of a degree) and no absorption.
#pragma once

#include <vector>

namespace virga::optics {

/// Refractive indices of water at 20 C for R, G, B: at 656, 589 and 470 nm. Daimon & Masumura 2007.
inline constexpr double waterIndex[3] = {1.331, 1.333, 1.338};

enum class PathModel {
    Polarised,  ///< s and p kept apart along the path, averaged where it ends: geometric optics as it is
    Paper,      ///< R and T averaged first, then multiplied along the path, as Wang et al. write it
};

struct DropTransferOptions {
    double index = 1.333;  ///< of the drop relative to the air, > 1
    PathModel model = PathModel::Polarised;
    int terms = 0;  ///< encounters n = 1 to `terms` are summed; 0 sums them all, in closed form
};

/// f_0 to f_order: f_l = integral over the sphere of D(theta) P_l(cos theta). The band l of the light that a drop
/// returns is f_l times the band l of its surroundings (Funk 1916, Hecke 1918). f_0 = 1 if all terms are summed; f_1 is
/// the mean cosine g.
///
/// Sum over n of Phi_n P_l(cos zeta_n): P_l is a sum of cos(j zeta), and over n each of those is a geometric series.
/// Gauss-Legendre panels over gamma, closer towards grazing. Error < 1e-13 for indices 1.1 to 2.4 (tests/optics);
/// order 0 to 4096, 4 ms for 256 and 0.1 s for 1024. Throws Error(InvalidArgument) for an index or an order out of
/// range.
std::vector<double> zonalCoefficients(int order, const DropTransferOptions& options = {});

/// How the light divides over the paths.
struct PathEnergies {
    std::vector<double> share;  ///< of the light that leaves at encounter 1, 2, ...
    double beyond;              ///< what leaves later; with the shares, 1
};
inline constexpr int maxPathEnergies = 4096;

/// The first `count` (1 to maxPathEnergies) encounters; `terms` is not looked at. Error < 1e-12 of each share. Throws
/// Error(InvalidArgument).
PathEnergies energyByPath(int count, const DropTransferOptions& options = {});

inline constexpr int binTermsForAll = 200;

/// Integral of D over the solid angle of each bin [edge_i, edge_(i+1)] [rad]; edges ascend within [0, pi]. Error <
/// 2e-15 of the light a bin, with rainbows and glory, as each path's turning points and the incidence angles that lead
/// to the edges are found first. `terms` = 0 takes binTermsForAll; what is left then (1.6e-8 for water) goes almost
/// straight past the drop's edge, at angles that fill the circle evenly, and is spread over the sphere. Throws
/// Error(InvalidArgument) for edges that do not ascend.
std::vector<double> binEnergies(const std::vector<double>& edges, const DropTransferOptions& options = {});

/// D averaged over rings, for lights too small for harmonics.
class RingTransfer {
public:
    /// Tabulates the energy within theta at 720 steps of a quarter of a degree.
    explicit RingTransfer(const DropTransferOptions& options = {});

    /// Mean of D [1/sr] over the ring of angles [theta - halfWidth, theta + halfWidth], cut to [0, pi]. halfWidth [rad]
    /// at least 1/8 degree is the angle that light, drop and map blur together: D itself is infinite at the rainbow.
    double mean(double theta, double halfWidth) const;

    /// Share of the light that is turned by less than theta.
    double energyWithin(double theta) const;

private:
    std::vector<double> within_;
};

}  // namespace virga::optics
