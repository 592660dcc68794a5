// SPDX-License-Identifier: Apache-2.0
// A spur gear with involute teeth as a primitive of its own: parameters in, nodes out. The profile
// is exact where it can be (arcs at tip and root) and a spline through points of the involute on
// the flanks. Tooth proportions as in ISO 53, profile A: addendum 1 m, dedendum 1.25 m.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include <robomosp/sdk/csg_primitive.h>
#include <robomosp/sdk/plugin.h>

namespace {

using namespace robomosp;
using Point = std::array<double, 2>;
using Curve = CsgCurve::Kind;

constexpr int kFlankPoints = 12;  ///< of each involute; the spline is then within 1e-5 modules

Point polar(double radius, double angle) {
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

/// Angle between the radius through a point of the involute and the one through its start, where
/// the pressure angle at the point is `pressure`.
double involute(double pressure) { return std::tan(pressure) - pressure; }

struct Tooth {
  double base, root, tip;  ///< radii [m]
  double half_at_base;     ///< half the angle the tooth takes at the base circle [rad]
  /// Half the angle the tooth takes at a radius >= base [rad].
  double half(double radius) const {
    return half_at_base - involute(std::acos(std::min(1.0, base / radius)));
  }
};

class InvoluteGear final : public CsgPrimitive {
 public:
  Result<CsgTree> build(const Params& params, Progress&) const override {
    const double module = params.real("module"), pressure = params.real("pressure_angle"),
                 shift = params.real("shift"), width = params.real("width"),
                 bore = params.real("bore");
    const long long teeth = params.integer("teeth");
    const double z = static_cast<double>(teeth), pitch = module * z / 2;
    Tooth tooth{};
    tooth.base = pitch * std::cos(pressure);
    tooth.root = pitch - module * (1.25 - shift);
    tooth.tip = pitch + module * (1 + shift);
    tooth.half_at_base =
        std::numbers::pi / (2 * z) + 2 * shift * std::tan(pressure) / z + involute(pressure);
    if (tooth.half(tooth.tip) * tooth.tip < 0.02 * module)
      return error(ErrorCode::invalid_argument,
                   "shift: teeth of " + std::to_string(teeth) +
                       " shifted that far come to a point below their tip circle",
                   "Give a smaller shift or more teeth.");
    if (bore / 2 >= tooth.root - module / 4)
      return error(ErrorCode::invalid_argument,
                   "bore: it leaves less than a quarter module of material below the teeth",
                   "Give a smaller bore or more teeth.");

    auto profile = std::make_shared<CsgProfile>();
    profile->loops.push_back(outline(tooth, teeth));
    if (bore > 0) {
      CsgLoop hole;
      hole.curves.push_back({Curve::circle, {{0, 0}, {bore / 2, 0}}});
      profile->loops.push_back(std::move(hole));
    }
    CsgNode wheel;
    wheel.kind = CsgKind::prism;
    wheel.name = "wheel";
    wheel.sizes[0] = width;
    wheel.profile = std::move(profile);
    CsgTree tree;
    tree.nodes.push_back(std::move(wheel));
    return tree;
  }

 private:
  /// Tooth after tooth, counter-clockwise; the first is on the x axis. Where the root lies within
  /// the base circle, the flank goes on radially.
  static CsgLoop outline(const Tooth& t, long long teeth) {
    const double foot = std::max(t.base, t.root);
    const double step = 2 * std::numbers::pi / static_cast<double>(teeth);
    CsgLoop loop;
    loop.start = polar(t.root, -t.half(foot));
    for (long long k = 0; k < teeth; ++k) {
      const double middle = static_cast<double>(k) * step;
      if (t.root < foot) loop.curves.push_back({Curve::line, {polar(foot, middle - t.half(foot))}});
      loop.curves.push_back({Curve::spline, flank(t, foot, middle, -1)});
      loop.curves.push_back(
          {Curve::arc, {polar(t.tip, middle), polar(t.tip, middle + t.half(t.tip))}});
      loop.curves.push_back({Curve::spline, flank(t, foot, middle, +1)});
      if (t.root < foot)
        loop.curves.push_back({Curve::line, {polar(t.root, middle + t.half(foot))}});
      // The last point is exactly the first, not what rounding makes of it.
      const Point end = k + 1 == teeth ? loop.start : polar(t.root, middle + step - t.half(foot));
      loop.curves.push_back({Curve::arc, {polar(t.root, middle + step / 2), end}});
    }
    return loop;
  }

  /// Points of the involute after its first: upwards on the right side (-1), downwards on the left.
  /// Steps are even in the involute's parameter tan(pressure angle), to which its arc length is
  /// quadratic, so they are shorter where it bends more.
  static std::vector<Point> flank(const Tooth& t, double foot, double middle, int side) {
    const auto parameter = [&](double radius) {
      return std::sqrt(std::max(0.0, radius * radius / (t.base * t.base) - 1));
    };
    const double low = parameter(foot), high = parameter(t.tip);
    std::vector<Point> points;
    for (int i = 1; i <= kFlankPoints; ++i) {
      const int at = side < 0 ? i : kFlankPoints - i;
      const double u = low + (high - low) * at / kFlankPoints;
      const double radius = at == kFlankPoints ? t.tip
                            : at == 0          ? foot
                                               : t.base * std::sqrt(1 + u * u);
      points.push_back(polar(radius, middle + side * t.half(radius)));
    }
    return points;
  }
};

const rmp_param kParams[] = {
    {"teeth", "int", "", "Number of teeth.", "20", nullptr, 6, 400},
    {"module", "real", "m", "Pitch diameter over number of teeth.", "0.002", nullptr, 1e-4, 0.1},
    {"width", "real", "m", "Length of the teeth along z.", "0.01", nullptr, 1e-4, 1},
    {"bore", "real", "m", "Diameter of the hole along z; 0 = none.", "0", nullptr, 0, 40},
    {"pressure_angle", "real", "rad", "At the pitch circle; 20 degrees is usual.",
     "0.3490658503988659", nullptr, 0.17, 0.53},
    {"shift", "real", "", "Profile shift in modules; positive makes thicker teeth.", "0", nullptr,
     -0.6, 1},
};

}  // namespace

RMP_PLUGIN("org.example.involute_gear", "0.1.0", "Apache-2.0", "Spur gears as primitives",
           RMP_PROVIDER(InvoluteGear, "involute_gear",
                        "Spur gear with involute teeth about z, from z = 0 up.", "gear,exact",
                        kParams))
