// SPDX-License-Identifier: Apache-2.0
#include "occt_support.h"

#include <bit>
#include <charconv>
#include <cmath>
#include <mutex>

#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Message_Printer.hxx>
#include <gp_Quaternion.hxx>

namespace robomosp::csg_occt {
namespace {

// A rotation matrix typed or composed by hand is accepted when it is orthonormal to this.
constexpr double kRotationTolerance = 1e-6;

// Finaliser of MurmurHash3 (Appleby, public domain): every input bit reaches every output bit.
std::uint64_t scramble(std::uint64_t x) {
  x ^= x >> 33;
  x *= 0xff51afd7ed558ccdULL;
  x ^= x >> 33;
  x *= 0xc4ceb9fe1a85ec53ULL;
  return x ^ (x >> 33);
}

}  // namespace

void Key::mix(std::uint64_t value) {
  a = scramble(a ^ (value + 0x9e3779b97f4a7c15ULL));
  b = scramble(std::rotl(b, 23) + value * 0xd6e8feb86659fd93ULL + a);
}
void Key::mix(double value) { mix(std::bit_cast<std::uint64_t>(value == 0 ? 0.0 : value)); }
void Key::mix(const Key& other) {
  mix(other.a);
  mix(other.b);
}
void Key::mix(const gp_Trsf& pose) {
  for (int row = 1; row <= 3; ++row)
    for (int column = 1; column <= 4; ++column) mix(pose.Value(row, column));
}

std::optional<gp_Trsf> to_trsf(const Pose& pose) {
  if (!is_rigid_motion(pose, kRotationTolerance)) return {};
  const auto& R = pose.R;
  gp_Trsf t;
  const gp_Vec p(pose.p[0] * kMillimetresPerMetre, pose.p[1] * kMillimetresPerMetre,
                 pose.p[2] * kMillimetresPerMetre);
  if (R == Pose{}.R) {
    t.SetTranslation(p);
    return t;
  }
  // By quaternion, because gp_Trsf::SetValues derives a scale from the determinant and OCCT
  // refuses to locate a shape by a scale that differs from 1 in the 14th digit.
  gp_Mat m(R[0], R[1], R[2], R[3], R[4], R[5], R[6], R[7], R[8]);
  gp_Quaternion q(m);
  q.Normalize();
  t.SetTransformation(q, p);
  return t;
}

bool is_identity(const gp_Trsf& t) {
  for (int row = 1; row <= 3; ++row)
    for (int column = 1; column <= 4; ++column)
      if (t.Value(row, column) != (row == column ? 1.0 : 0.0)) return false;
  return true;
}

TopoDS_Shape placed(const TopoDS_Shape& shape, const gp_Trsf& pose) {
  return is_identity(pose) ? shape : shape.Moved(TopLoc_Location(pose));
}

void silence_messenger() {
  static std::once_flag once;
  std::call_once(
      once, [] { Message::DefaultMessenger()->RemovePrinters(STANDARD_TYPE(Message_Printer)); });
}

void ProgressBridge::Show(const Message_ProgressScope&, Standard_Boolean) {
  const double position = GetPosition();
  if (position < last_ + 0.01) return;
  last_ = position;
  target_.report(from_ + (to_ - from_) * position, what_);
}

Error cancelled_error() { return error(ErrorCode::cancelled, "stopped by the user"); }

}  // namespace robomosp::csg_occt
