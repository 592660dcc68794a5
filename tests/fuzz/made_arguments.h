// SPDX-License-Identifier: Apache-2.0
// Random arguments of commands, made from the schemas of the program itself: numbers at the ends of
// their range and beyond, texts of any length, values of other kinds, long lists.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <string>

#include <nlohmann/json.hpp>

namespace robomosp::test {

using Json = nlohmann::ordered_json;

inline constexpr std::size_t kLongList = 100'000;

/// Records to work on; what fails of it has been changed by the run, which does not matter.
inline constexpr const char* kRecords = R"lua(
material.create{name = "brass", density = 8500}
solid.create{name = "pin", material = "brass",
             root = {kind = "cylinder", radius = 0.01, height = 0.05}}
solid.create{name = "block", root = {kind = "difference", children = {
             {kind = "box", x = 0.2, y = 0.1, z = 0.1}, {kind = "sphere", radius = 0.04}}}}
object.create{name = "bolt", parts = {{what = "pin"}, {what = "block", position = {0.3, 0, 0}}}}
robot.create{name = "arm", convention = "dh",
             links = {{a = 0.4, lower = -3, upper = 3, mass = 2},
                      {a = 0.3, alpha = 1, lower = -2, upper = 2, mass = 1},
                      {joint = "prismatic", d = 0.2, lower = 0, upper = 0.5, mass = 0.5}},
             poses = {here = {0, 0, 0.1}, there = {1, 1, 0.2}}}
trajectory.create{name = "stroke", segments = {{shape = "line",
                  points = {{0.4, 0, 0.1, 0, 0, 0}, {0.45, 0.05, 0.1, 0, 0, 0}}}}}
world.create{name = "cell"}
world.add_robot{id = "cell", robot = "arm", q = "here"}
world.add_object{id = "cell", what = "bolt", position = {2, 0, 0}}
world.add_trajectory{id = "cell", trajectory = "stroke"}
task.create{name = "shift", steps = {{step = "message", text = "hello"}}}
)lua";

/// Values as they are sent: a number may be one that JSON has no word for.
class Maker {
 public:
  explicit Maker(std::mt19937& random) : random_(random) {}

  [[nodiscard]] std::size_t pick(std::size_t n) {
    return std::uniform_int_distribution<std::size_t>(0, n - 1)(random_);
  }
  [[nodiscard]] bool chance(double p) {
    return std::uniform_real_distribution<double>(0, 1)(random_) < p;
  }

  Json number() {
    static const double kReals[] = {0,
                                    -0.0,
                                    1e308,
                                    -1e308,
                                    1e-308,
                                    5e-324,
                                    1e200,
                                    -1e200,
                                    1e-9,
                                    1e9,
                                    1e19,
                                    -1e19,
                                    1e15,
                                    1e5,
                                    3e38,
                                    1e-30,
                                    0.1,
                                    0.5,
                                    1,
                                    -1,
                                    2,
                                    3,
                                    10,
                                    100,
                                    1000,
                                    1e4,
                                    65536,
                                    3.14159,
                                    -1.5707963,
                                    6.3,
                                    0.01,
                                    0.001,
                                    std::numeric_limits<double>::infinity(),
                                    -std::numeric_limits<double>::infinity(),
                                    std::numeric_limits<double>::quiet_NaN()};
    static const std::int64_t kInts[] = {0,
                                         -1,
                                         std::numeric_limits<std::int64_t>::max(),
                                         std::numeric_limits<std::int64_t>::min(),
                                         std::int64_t{1} << 32,
                                         std::int64_t{1} << 31,
                                         -(std::int64_t{1} << 31),
                                         1'000'000'000,
                                         1,
                                         2,
                                         3,
                                         7};
    if (chance(0.35)) return std::uniform_real_distribution<double>(-2, 2)(random_);
    if (chance(0.3)) return kInts[pick(std::size(kInts))];
    return kReals[pick(std::size(kReals))];
  }
  Json small() { return std::uniform_real_distribution<double>(-1.5, 1.5)(random_); }

  Json text() {
    static const char* const kTexts[] = {
        "",          " ",     "arm",     "cell",       "pin",      "brass",   "stroke",
        "bolt",      "block", "shift",   "here",       "there",    "1",       "-1 mm",
        "1e999 deg", "nan",   "inf",     "0x10",       "link_1",   "robot#1", "a.b[3]",
        "\x1b[31m",  "\n",    "x == 1",  "cell.a + 1", "((((",     "\"",      "%s%n",
        "../x",      "é€😀",   "density", "links[1].a", "parts[1]", "numeric", "csv"};
    if (chance(0.03)) return std::string(std::size_t{1} << (4 + pick(14)), 'x');
    if (chance(0.02)) return std::string(200'000, '(');
    return kTexts[pick(std::size(kTexts))];
  }

  /// A value of any kind.
  Json any(int depth = 0) {
    switch (pick(depth > 3 ? 4 : 8)) {
      case 0: return nullptr;
      case 1: return chance(0.5);
      case 2: return number();
      case 3: return text();
      case 4: return list(depth);
      case 5: {
        Json out = Json::object();
        static const char* const kKeys[] = {"kind", "x", "y",        "z",    "radius", "height",
                                            "what", "a", "name",     "step", "shape",  "points",
                                            "q",    "d", "position", "rpy",  "links",  "root"};
        for (std::size_t n = pick(5); n > 0; --n)
          out[kKeys[pick(std::size(kKeys))]] = any(depth + 1);
        return out;
      }
      case 6:
        return {{"$handle", {{"kind", chance(0.5) ? "robot" : "world"}, {"number", 1 + pick(40)}}}};
      default: return list(depth);
    }
  }
  Json list(int depth) {
    Json out = Json::array();
    if (depth == 0 && chance(0.05)) {
      Json item = chance(0.5) ? number() : chance(0.5) ? Json(0.1) : any(3);
      // A long text in each would be gigabytes of the test's own.
      constexpr std::size_t kMostOfItem = 256;
      if (item.dump(-1, ' ', false, Json::error_handler_t::replace).size() > kMostOfItem)
        item = number();
      for (std::size_t i = 0; i < kLongList; ++i) out.push_back(item);
      return out;
    }
    const bool is_flat = chance(0.5);
    for (std::size_t n = pick(7); n > 0; --n) out.push_back(is_flat ? number() : any(depth + 1));
    return out;
  }

  /// One that the schema asks for, more often than not.
  Json value(const Json& p) {
    if (chance(0.12)) return any();
    const std::string type = p.value("type", "any");
    if (p.contains("choices") && !p["choices"].empty() && chance(0.9))
      return p["choices"][pick(p["choices"].size())];
    if (type == "bool") return chance(0.5);
    if (type == "int") return chance(0.6) ? Json(1 + pick(12)) : number();
    if (type == "real") return chance(0.4) ? small() : number();
    if (type == "string") return text();
    if (type == "path") return path();
    if (type == "vec3" || type == "real[]") {
      Json out = Json::array();
      const bool is_tame = chance(0.6);
      const std::size_t size = type == "vec3" && chance(0.9) ? 3
                               : chance(0.03)                ? kLongList
                                                             : pick(8);
      for (std::size_t i = 0; i < size; ++i) out.push_back(is_tame ? small() : number());
      return out;
    }
    if (type == "pose") {
      if (chance(0.4)) return {{"position", {small(), small(), small()}}, {"rpy", {small(), 0, 0}}};
      Json out = Json::array();
      for (int i = 0; i < 6; ++i) out.push_back(chance(0.7) ? small() : number());
      return out;
    }
    if (type == "matrix") {
      Json out = Json::array();
      const std::size_t columns = 1 + pick(6);
      for (std::size_t r = 1 + pick(6); r > 0; --r) {
        Json row = Json::array();
        for (std::size_t c = 0; c < columns; ++c) row.push_back(chance(0.7) ? small() : number());
        out.push_back(row);
      }
      return out;
    }
    if (type.starts_with("ref:")) {
      if (type.find("robot") != std::string::npos && chance(0.9)) return "arm";
      if (type.find("solid") != std::string::npos) return chance(0.5) ? "pin" : "block";
      if (type.find("object") != std::string::npos) return "bolt";
      if (type.find("world") != std::string::npos) return "cell";
      if (type.find("trajectory") != std::string::npos) return "stroke";
      if (type.find("material") != std::string::npos) return "brass";
      if (type.find("task") != std::string::npos) return "shift";
      return "recording#" + std::to_string(1 + pick(4));
    }
    return any();
  }
  /// Names within the folder that the program runs in.
  Json path() {
    static const char* const kNames[] = {
        "a.mtr",         "b.csg", "c.rbt",  "d.wld", "e.tjc",  "f.part", "g.tsk", "h.csv",
        "i.npz",         "j.png", "k.step", "l.stl", "m.urdf", "n.html", "o.dxf", "p.svg",
        "no/such/q.mtr", ".",     "",       "r",     "s.lua",  "t.obj",  "u.3mf", "v.c"};
    if (chance(0.03)) return std::string(5000, 'n') + ".mtr";
    return kNames[pick(std::size(kNames))];
  }

  Json arguments(const Json& params) {
    Json out = Json::object();
    const bool is_sparse = chance(0.5);
    for (const Json& p : params) {
      const bool is_needed = p.value("required", false);
      if (is_needed ? chance(0.02) : chance(is_sparse ? 0.85 : 0.5)) continue;
      out[p.at("name").get<std::string>()] = value(p);
    }
    if (chance(0.02)) out[text().get<std::string>()] = any();
    return out;
  }

 private:
  std::mt19937& random_;
};

/// JSON has no word for what is not finite; the program takes the words of Lua and files there.
inline std::string as_json(const Json& v) {
  if (v.is_number_float() && !std::isfinite(v.get<double>()))
    return std::isnan(v.get<double>()) ? "\"nan\"" : v.get<double>() > 0 ? "\"inf\"" : "\"-inf\"";
  if (v.is_array() || v.is_object()) {
    std::string out(1, v.is_array() ? '[' : '{');
    for (auto it = v.begin(); it != v.end(); ++it) {
      if (it != v.begin()) out += ',';
      if (v.is_object()) out += Json(it.key()).dump() + ":";
      out += as_json(*it);
    }
    return out + (v.is_array() ? ']' : '}');
  }
  return v.dump(-1, ' ', false, Json::error_handler_t::replace);
}

inline std::string as_lua(const Json& v) {
  if (v.is_null()) return "nil";
  if (v.is_number_float()) {
    const double x = v.get<double>();
    if (std::isnan(x)) return "(0/0)";
    if (std::isinf(x)) return x > 0 ? "math.huge" : "-math.huge";
  }
  if (v.is_string()) {
    std::string out = "\"";
    for (const char c : v.get<std::string>()) {
      const auto byte = static_cast<unsigned char>(c);
      if (byte >= 0x20 && byte < 0x7F && c != '"' && c != '\\') out += c;
      else {
        const std::string digits = std::to_string(byte);
        out += "\\" + std::string(3 - digits.size(), '0') + digits;
      }
    }
    return out + "\"";
  }
  if (v.is_array() || v.is_object()) {
    // A constructor of many different constants is too much for Lua's compiler.
    if (v.size() == kLongList)
      return "(function() local t = {} for i = 1, " + std::to_string(v.size()) +
             " do t[i] = " + as_lua(v[0]) + " end return t end)()";
    std::string out = "{";
    for (auto it = v.begin(); it != v.end(); ++it) {
      if (v.is_object()) out += "[" + as_lua(it.key()) + "] = ";
      out += as_lua(*it) + ", ";
    }
    return out + "}";
  }
  if (v.is_number_integer() && v.get<std::int64_t>() == std::numeric_limits<std::int64_t>::min())
    return "math.mininteger";
  return v.dump();
}

}  // namespace robomosp::test
