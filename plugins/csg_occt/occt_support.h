// SPDX-License-Identifier: Apache-2.0
// Small shared pieces of the Open CASCADE engine: units, placements, hashing, progress, texts
// (layer: plugin). Lengths are millimetres wherever an OCCT type appears, metres elsewhere:
// OCCT's absolute tolerance of 1e-7 costs four digits when a part is modelled in metres.
#pragma once

#include <cstdint>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>

#include <robomosp/sdk/csg_check.h>

#include <Message_ProgressIndicator.hxx>
#include <TopLoc_Location.hxx>
#include <TopoDS_Shape.hxx>
#include <gp_Dir.hxx>
#include <gp_Trsf.hxx>
#include <gp_XYZ.hxx>

namespace robomosp::csg_occt {

inline constexpr double kTurn = 2 * std::numbers::pi;  ///< a whole turn [rad]

inline constexpr double kMillimetresPerMetre = 1e3;

inline Vec3 metres(const gp_XYZ& p) {
  return {p.X() / kMillimetresPerMetre, p.Y() / kMillimetresPerMetre, p.Z() / kMillimetresPerMetre};
}
/// Without zeros below zero.
inline Vec3 unit(const gp_Dir& d) { return {d.X() + 0.0, d.Y() + 0.0, d.Z() + 0.0}; }

/// 128-bit content key; equal content gives an equal key in every run.
struct Key {
  std::uint64_t a = 0x9e3779b97f4a7c15ULL, b = 0xc2b2ae3d27d4eb4fULL;
  bool operator==(const Key&) const = default;
  void mix(std::uint64_t value);
  void mix(double value);
  void mix(const Key& other);
  void mix(const gp_Trsf& pose);
};
struct KeyHash {
  std::size_t operator()(const Key& k) const { return static_cast<std::size_t>(k.a ^ (k.b << 1)); }
};

/// The placement in millimetres, or nothing when it is not a finite rigid motion.
std::optional<gp_Trsf> to_trsf(const Pose& pose);
/// Exactly unmoved, so that moving can be skipped.
bool is_identity(const gp_Trsf& t);
/// The shape at the pose [mm]; shares all topology with the argument.
TopoDS_Shape placed(const TopoDS_Shape& shape, const gp_Trsf& pose);

/// Stops OCCT from printing on the program's standard output. [any thread]
void silence_messenger();

/// Hands an OCCT progress range on to a Progress and cancellation back.
class ProgressBridge final : public Message_ProgressIndicator {
 public:
  ProgressBridge(Progress& target, double from, double to, std::string_view what)
      : target_(target), from_(from), to_(to), what_(what) {}
  Standard_Boolean UserBreak() override { return target_.cancelled(); }
  void Show(const Message_ProgressScope&, Standard_Boolean) override;

 private:
  Progress& target_;
  double from_, to_, last_ = -1;
  std::string_view what_;
};

Error cancelled_error();

/// Thrown where cancellation is heard deep inside, caught by guarded().
struct Interrupted {};

/// Runs `work` and turns every exception into an Error that names the `task`.
template <class Work>
auto guarded(std::string_view task, Work&& work) -> decltype(work());

}  // namespace robomosp::csg_occt

#include <new>

#include <Standard_Failure.hxx>

namespace robomosp::csg_occt {
template <class Work>
auto guarded(std::string_view task, Work&& work) -> decltype(work()) {
  std::string what;
  try {
    return work();
  } catch (const Interrupted&) {
    return cancelled_error();
  } catch (const Standard_Failure& e) {
    what = e.GetMessageString() ? e.GetMessageString() : "";
    if (what.empty()) what = e.DynamicType()->Name();
  } catch (const std::bad_alloc&) {
    what = "out of memory";
  } catch (const std::exception& e) {
    what = e.what();
  } catch (...) {
    what = "unknown exception";
  }
  return error(ErrorCode::plugin_failed, std::string(task) + " failed inside Open CASCADE: " + what,
               "Simplify the solid or move its parts slightly.");
}
}  // namespace robomosp::csg_occt
