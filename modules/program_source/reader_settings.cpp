// SPDX-License-Identifier: Apache-2.0
#include "program_source/reader_settings.h"

#include <array>
#include <cstddef>
#include <utility>
#include <vector>

#include <robomosp/sdk/post_writer.h>

#include "model/placement.h"

namespace robomosp::program_source {

Map reader_settings(const ProviderInfo& reader, const model::Controller& c) {
  Map out;
  for (const ParamSpec& p : reader.schema) {
    if (p.name == "pulses") {
      List all;
      for (const bool is_external : {false, true})
        for (const model::ControllerAxis& a : c.axes)
          if (a.is_external == is_external) all.emplace_back(a.pulses);
      if (!all.empty()) out.set(p.name, Value(std::move(all)));
    }
    for (const model::ControllerOption& o : c.options) {
      if (o.name != p.name) continue;
      // Options are in mm, mm/s, degrees and degrees/s.
      const char* unit = p.unit == "m"       ? " mm"
                         : p.unit == "m/s"   ? " mm/s"
                         : p.unit == "rad/s" ? " deg/s"
                                             : " deg";
      out.set(p.name, p.unit.empty() ? o.value : o.value + unit);
    }
  }
  return out;
}
ForeignFile places_file(std::string_view reader, const model::Controller& c) {
  // X, Y, Z [mm] and the angles about the fixed axes x, y and z [degrees].
  const auto numbers = [](const model::ControllerPlace& place) {
    const post::Placed at =
        post::placed(model::pose(place.placement), post::Orientation::fixed_xyz);
    std::array<std::string, 6> out;
    for (std::size_t i = 0; i < 6; ++i) out[i] = post::trimmed(i < 3 ? at.mm[i] : at.ori[i - 3], 9);
    return out;
  };
  if (reader == "inform") {
    std::string out;
    for (const model::ControllerPlace& t : c.tools) {
      if (t.number < 0) continue;
      const auto n = numbers(t);
      out += "//TOOL " + std::to_string(t.number) + "\n///NAME " + t.name + "\n";
      for (std::size_t i = 0; i < 6; ++i) out += (i ? "," : "") + n[i];
      out += "\n";
    }
    return {"TOOL.CND", std::move(out)};
  }
  if (reader != "tp") return {};
  std::string out;
  const auto add = [&](const char* variable, const std::vector<model::ControllerPlace>& places) {
    std::string all;
    for (const model::ControllerPlace& p : places) {
      if (p.number < 1) continue;
      const auto n = numbers(p);
      all += "  [1," + std::to_string(p.number) + "] =\n  Group: 1\n  X: " + n[0] + " Y: " + n[1] +
             " Z: " + n[2] + "\n  W: " + n[3] + " P: " + n[4] + " R: " + n[5] + "\n";
    }
    if (!all.empty())
      out += std::string("[*SYSTEM*]") + variable + "  Storage: CMOS  Access: RW\n" + all;
  };
  add("$MNUFRAME", c.frames);
  add("$MNUTOOL", c.tools);
  return {"SYSFRAME.VA", std::move(out)};
}

}  // namespace robomosp::program_source
