// How many photons a pixel counted in the open beam, from line integrals alone: -log of counts with N photons
// has the variance e^p / N. Of integrals that are no logarithms of counts one over their variance, the same
// of all.
#pragma once

#include <optional>

#include "vdvr/expert/projections.hpp"

namespace vdvr {

enum class Integrals { logarithms, others };

/// By second differences along views of those along columns, D: E D^2 = 36 v where the object is smooth along
/// either (Immerkaer, CVIU 64, 1996). The median of D^2 e^-p over that of chi^2 of one degree of freedom, so
/// that edges do not count. Texture makes the photons too few. Nothing of fewer than three views or columns.
std::optional<double> photons_by_differences(const ProjectionSet& scan,
                                             Integrals integrals = Integrals::logarithms);

/// By the sinogram's empty wedge: what lies within radius R of the axis has no content where
/// |nu| > R |f| dtheta (nu cycles a view, f cycles a column). The median power there, under Blackman-Harris
/// windows, over ln 2. Blur between columns makes the photons too few. Parallel beam of even steps alone;
/// nothing where the wedge is narrower than the windows.
std::optional<double> photons_by_wedge(const ProjectionSet& scan,
                                       Integrals integrals = Integrals::logarithms);

/// Views in the order of their angles, of rows as they were seen those of one height after another; none
/// twice.
std::vector<std::int64_t> views_by_angle(const ProjectionSet& scan);

}  // namespace vdvr
