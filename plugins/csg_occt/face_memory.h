// SPDX-License-Identifier: Apache-2.0
// Volume integrals of a solid as a sum over its faces, each integrated over its trimmed parameter
// domain; integrals and checks of faces are cached, so that an edit computes only its new faces
// (layer: plugin).
#pragma once

#include <array>
#include <mutex>

#include "occt_support.h"

#include <NCollection_DataMap.hxx>
#include <TopTools_MapOfShape.hxx>
#include <TopTools_ShapeMapHasher.hxx>
#include <TopoDS_Face.hxx>

namespace robomosp::csg_occt {

/// About the origin of the shape's frame, in millimetres.
struct Integrals {
  double volume = 0, area = 0;
  std::array<double, 3> first{};
  std::array<double, 6> second{};  ///< xx yy zz xy yz xz
  /// Sum of tolerance times length over trimming curves that are approximations [mm^2].
  double trim_doubt = 0;

  void add(const Integrals& other);
};

/// Cached results for faces, by topology and location.
class FaceMemory {
 public:
  /// Functions with a Progress throw Interrupted after cancellation, which is checked before each
  /// face and each piece of its edges. [any thread]
  Integrals of_face(const TopoDS_Face& face);
  Integrals of_face(const TopoDS_Face& face, const Progress& progress);
  /// Sum over all faces in the shape. [any thread]
  Integrals of(const TopoDS_Shape& shape);
  Integrals of(const TopoDS_Shape& shape, const Progress& progress);
  /// Sets more accurate integrals of a face than its surface gives, for example from its
  /// construction. [any thread]
  void learn(const TopoDS_Face& face, const Integrals& integrals);
  /// True if the face was part of a solid that passed its check. [any thread]
  bool is_verified(const TopoDS_Shape& face);
  void set_verified(const TopoDS_Shape& solid);

 private:
  std::mutex mutex_;
  NCollection_DataMap<TopoDS_Shape, Integrals, TopTools_ShapeMapHasher> known_, learnt_;
  TopTools_MapOfShape verified_;
};

/// Integrals in millimetres to Moments in metres, after moving the solid by `pose`.
Moments to_moments(const Integrals& integrals, const gp_Trsf& pose, double extent);

}  // namespace robomosp::csg_occt
