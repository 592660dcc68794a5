// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "io/native.h"
#include "ioci/core/commands.h"
#include "ioci/core/library_files.h"
#include "kernel/unknown_name.h"
#include "spatial/rotation.h"

namespace robomosp::ioci {

// --- schemas -------------------------------------------------------------------------------

ParamSpec field(std::string name, std::string type, std::string unit, std::string doc) {
  ParamSpec p;
  p.name = std::move(name);
  p.type = std::move(type);
  p.unit = std::move(unit);
  p.doc = std::move(doc);
  return p;
}

ParamSpec optional(std::string name, std::string type, std::string unit, std::string doc) {
  return field(std::move(name), std::move(type), std::move(unit), std::move(doc));
}

ParamSpec needed(std::string name, std::string type, std::string unit, std::string doc) {
  ParamSpec p = field(std::move(name), std::move(type), std::move(unit), std::move(doc));
  p.required = true;
  return p;
}

ParamSpec defaulted(std::string name, std::string type, std::string unit, Value value,
                    std::string doc) {
  ParamSpec p = field(std::move(name), std::move(type), std::move(unit), std::move(doc));
  p.default_value = std::move(value);
  return p;
}

ParamSpec choice(std::string name, std::vector<std::string> choices, std::string doc, bool must) {
  ParamSpec p = field(std::move(name), "enum", "", std::move(doc));
  if (must) p.required = true;
  else p.default_value = Value(choices.front());
  p.choices = std::move(choices);
  return p;
}

ParamSpec self(std::string kinds) {
  std::string words = kinds;
  for (std::size_t at = 0; (at = words.find('|', at)) != std::string::npos; at += 4)
    words.replace(at, 1, " or ");
  return needed("id", "ref:" + std::move(kinds), "", "Name or handle of the " + words + ".");
}

ParamSpec between(ParamSpec p, double min, double max) {
  p.min = min;
  p.max = max;
  return p;
}

ParamSpec above_zero(ParamSpec p) {
  p.min = std::numeric_limits<double>::denorm_min();
  return p;
}

// --- checked arguments ---------------------------------------------------------------------

bool has(const Map& args, std::string_view name) {
  const Value* v = args.find(name);
  return v && !v->is_nil();
}
double real(const Map& args, std::string_view name) {
  const Value* v = args.find(name);
  return v ? v->number() : 0;
}
std::int64_t integer(const Map& args, std::string_view name) {
  const Value* v = args.find(name);
  return v && v->as_int() ? *v->as_int() : 0;
}
bool flag(const Map& args, std::string_view name) {
  const Value* v = args.find(name);
  return v && v->as_bool() && *v->as_bool();
}
std::string text_of(const Map& args, std::string_view name) {
  const Value* v = args.find(name);
  return v && v->as_string() ? *v->as_string() : std::string();
}
std::vector<double> reals(const Value* value) {
  if (!value) return {};
  if (const NumericArray* a = value->as_array()) return a->data();
  std::vector<double> out;
  if (const List* list = value->as_list())
    for (const Value& v : *list) out.push_back(v.number());
  return out;
}
std::vector<double> reals(const Map& args, std::string_view name) { return reals(args.find(name)); }
Vec3 vec3(const Map& args, std::string_view name) {
  const auto v = reals(args, name);
  return v.size() == 3 ? Vec3{v[0], v[1], v[2]} : Vec3{};
}
AnyId ref(const Map& args, std::string_view name) {
  const Value* v = args.find(name);
  const Handle* h = v ? v->as_handle() : nullptr;
  if (!h) return {};
  const auto kind = kind_from(h->kind);
  return kind ? AnyId{*kind, h->number} : AnyId{};
}
std::string name_in(const CommandContext& ctx, AnyId id) { return ctx.snapshot().describe(id); }

Result<AnyId> read_ref(const CommandContext& ctx, std::string_view kinds, const Value& value,
                       std::string_view path) {
  auto handle = ctx.resolve(kinds, value);
  if (!handle.ok()) return std::move(handle).error().in(path);
  return Application::record_id(ctx.snapshot(), *handle);
}

namespace {

Result<Vec3> read_vec3(const Value& value, const char* unit, std::string_view path) {
  ParamSpec p = field("", "vec3", unit, "");
  auto checked = check_value(p, value, path);
  if (!checked.ok()) return std::move(checked).error();
  const auto v = reals(&*checked);
  return Vec3{v[0], v[1], v[2]};
}

}  // namespace

namespace {

constexpr std::pair<std::string_view, model::PositionRepresentation> kPositions[] = {
    {"position", model::PositionRepresentation::cartesian},
    {"cylindrical", model::PositionRepresentation::cylindrical},
    {"spherical", model::PositionRepresentation::spherical}};
constexpr std::pair<std::string_view, model::AngleRepresentation> kAngles[] = {
    {"rpy", model::AngleRepresentation::rpy},
    {"xyz", model::AngleRepresentation::xyz},
    {"zyz", model::AngleRepresentation::zyz}};
constexpr std::string_view kRotations[] = {"quaternion", "axis_angle"};

/// "m", or "m, rad, m".
const char* unit_of_notation(model::PositionRepresentation notation) {
  switch (notation) {
    case model::PositionRepresentation::cylindrical: return "m, rad, m";
    case model::PositionRepresentation::spherical: return "m, rad, rad";
    case model::PositionRepresentation::cartesian: break;
  }
  return "m";
}

/// Sets what one field of a placement says; false = it is none of a placement.
Result<bool> set_part(model::Placement& p, std::string_view name, const Value& value,
                      std::string_view path) {
  for (const auto& [word, coordinates] : kPositions) {
    if (word != name) continue;
    RMP_TRY_ASSIGN(p.position, read_vec3(value, unit_of_notation(coordinates), path));
    p.coordinates = coordinates;
    return true;
  }
  for (const auto& [word, notation] : kAngles) {
    if (word != name) continue;
    RMP_TRY_ASSIGN(p.angles, read_vec3(value, "rad", path));
    p.notation = notation;
    return true;
  }
  for (const std::string_view word : kRotations) {
    if (word != name) continue;
    // A pose reads them; a record keeps angles.
    const auto dot = path.rfind('.');
    RMP_TRY_ASSIGN(const Value checked,
                   check_value(field("", "pose", "", ""), Map{{std::string(name), value}},
                               path.substr(0, dot == std::string_view::npos ? 0 : dot)));
    p.angles = model::placement(*pose_from(checked), p.notation).angles;
    return true;
  }
  return false;
}

}  // namespace

Result<model::Placement> read_placement(const Value* value, std::string_view path) {
  model::Placement out;
  if (!value || value->is_nil()) return out;
  // The schema's check reports every fault; what follows keeps the notation it normalises away.
  RMP_TRY_ASSIGN(const Value checked, check_value(field("", "pose", "", ""), *value, path));
  const std::string where(path);
  if (const Map* map = value->as_map()) {
    for (const auto& [key, v] : *map) RMP_TRY(set_part(out, key, v, where + "." + key));
    return out;
  }
  const List* list = value->as_list();
  if (list && list->size() == 6) {
    RMP_TRY_ASSIGN(out.position, read_vec3(List(list->begin(), list->begin() + 3), "m", where));
    RMP_TRY_ASSIGN(out.angles, read_vec3(List(list->begin() + 3, list->end()), "rad", where));
    return out;
  }
  const auto pose = pose_from(checked);
  if (!pose) return error(ErrorCode::invalid_argument, value->text() + " is not a pose", {}, where);
  return model::placement(*pose);
}

Schema placement_fields(std::string frame) {
  return {
      optional("placement", "pose", "", "Placement in " + frame + "; or give position and angles."),
      optional("position", "vec3", "m", "Its origin in " + frame + "."),
      optional("cylindrical", "vec3", "m, rad, m",
               "Instead of position: radius, angle about z measured from x, and z."),
      optional("spherical", "vec3", "m, rad, rad",
               "Instead of position: radius, angle about z measured from x, and angle from z."),
      optional("rpy", "vec3", "rad", "Roll, pitch, yaw: R = Rz(yaw) Ry(pitch) Rx(roll)."),
      optional("xyz", "vec3", "rad", "Instead of rpy: angles about the moving x, y and z axes."),
      optional("zyz", "vec3", "rad", "Instead of rpy: angles about the moving z, y and z axes."),
      optional("quaternion", "real[]", "",
               "Instead of rpy: rotation w, x, y, z of any length except zero."),
      optional("axis_angle", "vec(x, y, z, angle) or map{axis: vec3; angle: real [rad]}", "",
               "Instead of rpy: rotation {x, y, z, angle} or {axis = {x, y, z}, angle = angle}.")};
}

Result<model::Placement> read_placement_fields(const Map& table, std::string_view path) {
  const Value* whole = table.find("placement");
  Map parts;
  for (const std::string_view key : kPlacementFields)
    if (const Value* v = table.find(key); v && !v->is_nil() && key != "placement")
      parts.set(std::string(key), *v);
  if (whole && !whole->is_nil()) {
    if (!parts.empty())
      return error(ErrorCode::invalid_argument,
                   "there is both a placement and a " + parts.begin()->first, "Give one of them.",
                   std::string(path));
    return read_placement(whole, std::string(path) + ".placement");
  }
  if (parts.empty()) return model::Placement{};
  const Value v(std::move(parts));
  return read_placement(&v, path);
}

Result<bool> set_placement(model::Placement& p, std::string_view name, const Value& value,
                           std::string_view path) {
  if (name == "placement") {
    RMP_TRY_ASSIGN(p, read_placement(&value, path));
    return true;
  }
  if (name.starts_with("position.") && name.size() == 10 && name[9] >= 'x' && name[9] <= 'z') {
    const auto axis = static_cast<std::size_t>(name[9] - 'x');
    const std::string unit(model::position_units(p.coordinates)[axis]);
    RMP_TRY_ASSIGN(const Value v, check_value(field("", "real", unit, ""), value, path));
    p.position[axis] = v.number();
    return true;
  }
  return set_part(p, name, value, path);
}

Result<Map> read_map(const CommandContext& ctx, const Schema& schema, const Value& value,
                     std::string_view path) {
  const Map* map = value.as_map();
  if (!map && value.as_list() && value.as_list()->empty()) {
    static const Map none;
    map = &none;
  }
  if (!map)
    return error(ErrorCode::invalid_argument, value.text() + " is not a table of named values",
                 "Give named values such as {name = \"a\"}.", std::string(path));
  auto checked = check(
      schema, *map, [&](std::string_view kinds, const Value& v) { return ctx.resolve(kinds, v); });
  if (!checked.ok()) return std::move(checked).error().in(path);
  return std::move(*checked);
}

Result<model::ProviderChoice> read_provider(const Value& value, std::string_view path) {
  model::ProviderChoice out;
  if (value.is_nil()) return out;
  if (const std::string* name = value.as_string()) {
    out.name = *name;
    return out;
  }
  const Map* map = value.as_map();
  if (!map)
    return error(ErrorCode::invalid_argument, value.text() + " is not a provider",
                 "Give its name, or {name = \"numeric\", params = {...}}.", std::string(path));
  for (const auto& [key, v] : *map) {
    if (key == "name" && v.as_string()) {
      out.name = *v.as_string();
    } else if (key == "params" && (v.as_map() || (v.as_list() && v.as_list()->empty()))) {
      if (!v.as_map()) continue;
      for (const auto& [name, given] : *v.as_map()) {
        if (given.as_bool()) out.params[name] = *given.as_bool();
        else if (given.as_int()) out.params[name] = *given.as_int();
        else if (given.as_real()) out.params[name] = *given.as_real();
        else if (given.as_string()) out.params[name] = *given.as_string();
        else if (given.as_array() || given.as_list()) out.params[name] = reals(&given);
        else
          return error(ErrorCode::invalid_argument, given.text() + " is not a parameter's value",
                       {}, std::string(path) + ".params." + name);
      }
    } else {
      return error(ErrorCode::invalid_argument, text::quote(key) + " does not fit a provider",
                   "Give {name = \"numeric\", params = {...}}.", std::string(path));
    }
  }
  return out;
}

Error unknown_name(std::string_view what, std::string_view name,
                   const std::vector<std::string>& known) {
  return robomosp::unknown_name(what, name, known);
}

// --- values --------------------------------------------------------------------------------

Value vec_value(const Vec3& v, std::string unit) {
  return NumericArray({v[0], v[1], v[2]}, std::move(unit));
}

Value sym_value(const Sym3& s, std::string unit) {
  return NumericArray({s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz}, 3, 3,
                      std::move(unit));
}

Value placement_value(const model::Placement& p) {
  const auto position = static_cast<std::size_t>(p.coordinates);
  const auto angles = static_cast<std::size_t>(p.notation);
  // By PositionRepresentation; one a number where they differ.
  constexpr const char* kUnits[] = {"m", "m, rad, m", "m, rad, rad"};
  return Map{{std::string(kPositions[position].first), vec_value(p.position, kUnits[position])},
             {std::string(kAngles[angles].first), vec_value(p.angles, "rad")}};
}

Value mass_value(const MassProperties& m) {
  return Map{{"mass", m.mass},
             {"com", vec_value(m.com, "m")},
             {"inertia", sym_value(m.inertia, "kg m^2")}};
}

Value provider_value(const model::ProviderChoice& p) {
  Map params;
  for (const auto& [name, v] : p.params)
    params.set(name,
               std::visit(
                   [](const auto& x) -> Value {
                     if constexpr (std::is_same_v<std::decay_t<decltype(x)>, std::vector<double>>)
                       return NumericArray(x);
                     else return x;
                   },
                   v));
  return Map{{"name", p.name}, {"params", std::move(params)}};
}

Value ref_value(const document::Snapshot& s, AnyId id) {
  const model::Record* r = id ? s.find(id) : nullptr;
  return r ? Value(r->name) : Value();
}

std::string colour_text(const Colour& c) {
  const auto byte = [](float x) {
    return static_cast<unsigned>(std::lround(std::clamp(x, 0.0F, 1.0F) * 255.0F));
  };
  char out[16];
  if (c.a < 1.0F)
    std::snprintf(out, sizeof out, "#%02x%02x%02x%02x", byte(c.r), byte(c.g), byte(c.b), byte(c.a));
  else std::snprintf(out, sizeof out, "#%02x%02x%02x", byte(c.r), byte(c.g), byte(c.b));
  return out;
}

Value colour_value(const Colour& c) {
  return NumericArray({static_cast<double>(c.r), static_cast<double>(c.g), static_cast<double>(c.b),
                       static_cast<double>(c.a)});
}

Result<Colour> read_colour(const Value& v, std::string_view path) {
  const auto fault = [&](std::string message) {
    return error(ErrorCode::invalid_argument, std::move(message),
                 "Give \"#rrggbb\", \"#rrggbbaa\" or {r, g, b[, a]} from 0 to 1.",
                 std::string(path));
  };
  if (const std::string* s = v.as_string()) {
    if ((s->size() != 7 && s->size() != 9) || (*s)[0] != '#')
      return fault(text::quote(*s) + " is not a colour");
    float part[4] = {0, 0, 0, 1};
    for (std::size_t i = 0; 2 * i + 2 < s->size(); ++i) {
      int byte = 0;
      for (const char c : s->substr(1 + 2 * i, 2)) {
        const int digit = c >= '0' && c <= '9'   ? c - '0'
                          : c >= 'a' && c <= 'f' ? c - 'a' + 10
                          : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                                 : -1;
        if (digit < 0) return fault(text::quote(*s) + " is not a colour");
        byte = 16 * byte + digit;
      }
      part[i] = static_cast<float>(byte) / 255.0F;
    }
    return Colour{part[0], part[1], part[2], part[3]};
  }
  const auto numbers = reals(&v);
  if (numbers.size() != 3 && numbers.size() != 4) return fault(v.text() + " is not a colour");
  for (const double x : numbers)
    if (!(x >= 0 && x <= 1)) return fault(text::print(x) + " is not between 0 and 1");
  const auto f = [](double x) { return static_cast<float>(x); };
  return Colour{f(numbers[0]), f(numbers[1]), f(numbers[2]),
                numbers.size() == 4 ? f(numbers[3]) : 1.0F};
}

Map pose_map(const Pose& t) {
  const spatial::Quaternion q = spatial::to_quaternion(t.R);
  const Vec3 rpy = spatial::to_rpy(t.R);
  // Scripts ask for poses in loops: the four arrays share one block.
  const auto block = std::make_shared<const std::array<double, 26>>(
      std::array<double, 26>{t.R[0], t.R[1], t.R[2], t.p[0], t.R[3], t.R[4], t.R[5], t.p[1], t.R[6],
                             t.R[7], t.R[8], t.p[2], 0,      0,      0,      1,      t.p[0], t.p[1],
                             t.p[2], rpy[0], rpy[1], rpy[2], q.w,    q.x,    q.y,    q.z});
  const auto part = [&](std::size_t first, std::size_t rows, std::size_t cols, const char* unit) {
    return NumericArray(std::shared_ptr<const double>(block, block->data() + first), rows, cols,
                        unit);
  };
  Map out;
  out.append("pose", part(0, 4, 4, ""));
  out.append("position", part(16, 3, 0, "m"));
  out.append("rpy", part(19, 3, 0, "rad"));
  out.append("quaternion", part(22, 4, 0, ""));
  return out;
}

// --- library -------------------------------------------------------------------------------

namespace {

/// "steel 1018" and "steel-1018" are the file steel_1018.
std::string plain(std::string_view name) {
  std::string out(name);
  for (char& c : out)
    c = c == ' ' || c == '-' ? '_' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

}  // namespace

std::vector<std::filesystem::path> library_folders(const Application& app) {
  std::vector<std::filesystem::path> out;
  std::error_code none;
  for (const auto& folder : app.library)
    out.push_back(std::filesystem::weakly_canonical(folder, none));
  return out;
}

bool is_within(std::span<const std::filesystem::path> folders, const std::filesystem::path& file) {
  return std::any_of(folders.begin(), folders.end(), [&file](const auto& folder) {
    return std::mismatch(folder.begin(), folder.end(), file.begin(), file.end()).first ==
           folder.end();
  });
}

std::vector<std::filesystem::path> library_folders(const Application& app, Kind kind) {
  std::vector<std::filesystem::path> out;
  for (const auto& folder : app.library) {
    out.push_back(folder / model::info(kind).folder);
    if (kind == Kind::object || kind == Kind::solid) out.push_back(folder / "tools");
  }
  return out;
}

std::map<std::string, std::filesystem::path> library_files(const Application& app, Kind kind) {
  std::map<std::string, std::filesystem::path> out;
  for (const auto& folder : library_folders(app, kind)) {
    std::error_code none;
    for (std::filesystem::recursive_directory_iterator it(folder, none), end; !none && it != end;
         it.increment(none))
      if (it->path().extension() == io::extension(kind))
        out.emplace(it->path().stem().string(), it->path());
  }
  return out;
}

std::vector<std::string> library_names(const Application& app, Kind kind) {
  std::vector<std::string> out;
  for (const auto& [name, file] : library_files(app, kind)) out.push_back(name);
  return out;
}

std::optional<std::filesystem::path> library_file(const Application& app, Kind kind,
                                                  std::string_view name) {
  if (name.find('/') != std::string_view::npos || name.empty()) return std::nullopt;
  const std::string wanted = plain(name);
  for (const auto& folder : library_folders(app, kind)) {
    std::error_code none;
    for (std::filesystem::recursive_directory_iterator it(folder, none), end; !none && it != end;
         it.increment(none))
      if (it->path().extension() == io::extension(kind) &&
          plain(it->path().stem().string()) == wanted)
        return it->path();
  }
  return std::nullopt;
}

}  // namespace robomosp::ioci
