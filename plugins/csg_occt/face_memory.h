// SPDX-License-Identifier: Apache-2.0
// Volume integrals of a solid as a sum over its faces, each integrated over its trimmed parameter
// domain; integrals and checks of faces are remembered, so that an edit pays only for the faces it
// made (layer: plugin).
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
  /// Sum of tolerance times length over trimming curves that are only approximations [mm^2].
  double trim_doubt = 0;

  void add(const Integrals& other);
};

/// Everything known about faces, by topology and place.
class FaceMemory {
 public:
  /// Those with a Progress throw Interrupted once it is cancelled; it is asked before each face and
  /// each piece of its edges. [any thread]
  Integrals of_face(const TopoDS_Face& face);
  Integrals of_face(const TopoDS_Face& face, const Progress& progress);
  /// Sum over all faces in the shape. [any thread]
  Integrals of(const TopoDS_Shape& shape);
  Integrals of(const TopoDS_Shape& shape, const Progress& progress);
  /// What is known of a face better than its surface tells, such as by how it was made; its
  /// integrals are these from now on. [any thread]
  void learn(const TopoDS_Face& face, const Integrals& integrals);
  /// Whether the face was part of a solid that passed its check. [any thread]
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
