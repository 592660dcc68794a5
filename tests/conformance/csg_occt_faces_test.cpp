// SPDX-License-Identifier: Apache-2.0
// Integrals over faces of the engine by Open CASCADE where the outline of a face is damaged: the
// work has an end, and whoever cancels it is heard at once.
#include <cmath>
#include <cstddef>
#include <numbers>

#include <gtest/gtest.h>

#include "face_memory.h"

#include <BRepBuilderAPI_MakeEdge.hxx>
#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_MakeWire.hxx>
#include <Geom_BSplineCurve.hxx>
#include <TColStd_Array1OfInteger.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TColgp_Array1OfPnt.hxx>
#include <gp_Pln.hxx>

namespace robomosp::csg_occt {
namespace {

constexpr int kDegree = 4, kPoles = 805, kSpans = kPoles - kDegree;

/// Counts how often it is asked, and says yes from the `last`-th time on.
class Asked final : public Progress {
 public:
  explicit Asked(std::size_t last = 0) : last_(last) {}
  void report(double, std::string_view) override {}
  [[nodiscard]] bool cancelled() const override { return ++count == last_; }
  mutable std::size_t count = 0;

 private:
  std::size_t last_;
};

/// A disc whose rim is one curve with weights that differ by six orders, as in files with damaged
/// numbers: no polynomial follows its corners.
TopoDS_Face damaged_face() {
  TColgp_Array1OfPnt poles(1, kPoles);
  TColStd_Array1OfReal weights(1, kPoles);
  for (int i = 1; i <= kPoles; ++i) {
    const double turn = 2 * std::numbers::pi * (i - 1) / (kPoles - 1);
    poles(i) = gp_Pnt(100 * std::cos(turn), 100 * std::sin(turn), 0);
    weights(i) = i % 2 ? 1 : 1e-6;
  }
  poles(kPoles) = poles(1);
  weights(kPoles) = 1;
  TColStd_Array1OfReal knots(1, kSpans + 1);
  TColStd_Array1OfInteger multiplicities(1, kSpans + 1);
  for (int i = 1; i <= kSpans + 1; ++i) {
    knots(i) = i;
    multiplicities(i) = i == 1 || i == kSpans + 1 ? kDegree + 1 : 1;
  }
  const Handle(Geom_BSplineCurve) rim =
      new Geom_BSplineCurve(poles, weights, knots, multiplicities, kDegree);
  BRepBuilderAPI_MakeWire wire(BRepBuilderAPI_MakeEdge(rim).Edge());
  return BRepBuilderAPI_MakeFace(gp_Pln(), wire.Wire(), false).Face();
}

TEST(OcctFaces, IntegrationAlongADamagedEdgeEndsAfterItsShareOfHalvings) {
  FaceMemory memory;
  const Asked asked;
  const Integrals found = memory.of_face(damaged_face(), asked);
  // Once for the face, twice for its edge, and for two halves of each of 2000 halvings.
  EXPECT_EQ(asked.count, 1U + 2 + 2 * 2000);
  EXPECT_GT(found.trim_doubt, 0) << "what was left is told as doubt";
}

TEST(OcctFaces, CancellationIsHeardAtOnceAndLeavesNothingHalfDone) {
  const TopoDS_Face face = damaged_face();
  FaceMemory memory;
  for (const std::size_t last : {1U, 2U, 3U, 1500U, 4003U}) {
    const Asked asked(last);
    EXPECT_THROW(memory.of_face(face, asked), Interrupted) << last;
    EXPECT_EQ(asked.count, last);
    const Asked again(last);
    EXPECT_THROW(memory.of(face, again), Interrupted) << last;
    EXPECT_EQ(again.count, last);
  }
  EXPECT_EQ(memory.of_face(face).area, FaceMemory().of_face(face).area);
  const Asked known(1);
  EXPECT_EQ(memory.of_face(face, known).area, memory.of_face(face).area);
  EXPECT_EQ(known.count, 0U) << "what is remembered needs no work";
}

}  // namespace
}  // namespace robomosp::csg_occt
