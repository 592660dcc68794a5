// SPDX-License-Identifier: Apache-2.0
// A CsgProfile as checked plane faces, and its splines (layer: plugin).
#pragma once

#include <array>
#include <vector>

#include "occt_support.h"

#include <Geom2d_BSplineCurve.hxx>
#include <TopoDS_Face.hxx>
#include <gp_Pln.hxx>
#include <gp_XY.hxx>

namespace robomosp::csg_occt {

/// The cubic spline through points with continuous curvature, zero curvature at its ends, and chord
/// lengths as parameters; at least two points, with no two successive ones equal.
class NaturalSpline {
 public:
  explicit NaturalSpline(const std::vector<gp_XY>& points);
  std::size_t spans() const { return knots_.size() - 1; }
  /// Parameters of the points: from 0 up.
  const std::vector<double>& knots() const { return knots_; }
  gp_XY at(double parameter) const;
  /// Bezier points of a span.
  std::array<gp_XY, 4> bezier(std::size_t span) const;
  Handle(Geom2d_BSplineCurve) curve() const;

 private:
  std::vector<double> knots_;
  std::vector<std::array<gp_XY, 4>> coefficients_;  // by powers of the distance from the knot
};

struct ProfileUse {
  gp_Pln plane;              ///< where the profile's x and y lie [mm]
  bool is_revolved = false;  ///< about its y axis: no point may lie to the left of it
};

struct Region {
  TopoDS_Face face;
  double area = 0;      ///< [mm^2]
  double moment_x = 0;  ///< integral of x over the area [mm^3]
};

/// One face per region with its holes; the loops were checked not to cross or touch. Errors name
/// loop and curve, counted from 1, and have no location.
Result<std::vector<Region>> profile_regions(const CsgProfile& profile, const ProfileUse& use,
                                            const Progress& progress);

/// Mixes the content of a profile into a key.
void mix(Key& key, const CsgProfile& profile);

}  // namespace robomosp::csg_occt
