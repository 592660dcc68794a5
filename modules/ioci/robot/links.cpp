// SPDX-License-Identifier: Apache-2.0
// Links of a robot: rows, origins, joints, limits, drives, springs, given masses, designed parts.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "ioci/core/argument_types.h"
#include "ioci/core/record_params.h"
#include "ioci/robot/robots.h"
#include "ioci/robot/shown_robot.h"
#include "kernel/bare_numbers.h"
#include "kernel/text.h"
#include "kernel/type.h"
#include "kernel/units.h"
#include "model/words.h"
#include "robotics/build_model.h"
#include "robotics/coordinates.h"
#include "robotics/maker_axes.h"

namespace robomosp::ioci {

using model::JointKind;
using model::Link;
using model::Robot;

namespace {

/// The fields of a link as commands take them.
Schema make_link_params() {
  Schema s = led_by({"name", "parent", "joint", "convention", "origin", "axis", "mimic", "passive"},
                    record_params("robot", "links"));
  param_named(s, "origin").type = "bool or vec3 or pose @group(Place in the parent)";
  ParamSpec& mimic = param_named(s, "mimic");
  mimic.type = "bool or " + mimic.type;
  ParamSpec& inertia = param_named(s, "inertia");
  inertia.type = std::string(kInertiaType) + " @group(Mass)";
  param_named(s, "parts").type = "list<type:body> @group(Mass)";
  return s;
}

Schema make_link_schema(bool is_prismatic, bool creating) {
  Schema s = plain_params(link_params(), is_prismatic ? 1 : 0);
  if (creating) param_named(s, "joint").default_value = Value(model::kJointWords[0]);
  return s;
}

}  // namespace

const Schema& link_params() {
  static const Schema all = make_link_params();
  return all;
}

const Schema& link_schema(JointKind kind, bool creating) {
  // Made once: a robot may have very many links.
  static const std::array<Schema, 4> all{
      make_link_schema(false, false), make_link_schema(false, true), make_link_schema(true, false),
      make_link_schema(true, true)};
  return all[(kind == JointKind::prismatic ? 2U : 0U) + (creating ? 1U : 0U)];
}

namespace {

bool is_false(const Value& v) { return v.as_bool() && !*v.as_bool(); }

/// The origin, and what goes with it: a link has a row or an origin.
Result<void> apply_place(const Map& args, Link& l, const std::string& path) {
  if (has(args, "origin")) {
    const Value& origin = *args.find("origin");
    if (is_false(origin)) {
      l.origin.reset();
      l.axis = {0, 0, 1};
    } else {
      const Map* table = origin.as_map();
      const bool is_position = (origin.as_list() && origin.as_list()->size() == 3) ||
                               (origin.as_array() && origin.as_array()->data().size() == 3);
      const Map position{{"position", origin}};
      if (is_position) table = &position;
      if (table && !table->find("matrix")) {
        RMP_TRY_ASSIGN(l.origin, read_placement_fields(*table, path + ".origin"));
      } else {
        RMP_TRY_ASSIGN(l.origin, read_placement(&origin, path + ".origin"));
      }
      l.row = {};
      l.convention.reset();
    }
  }
  if (has(args, "axis") && !l.origin)
    return error(ErrorCode::invalid_argument, "an axis can be given only with an origin",
                 "The axis of a row is z; give an origin too.", path + ".axis");
  for (const char* name : {"a", "alpha", "d", "theta"})
    if (l.origin && has(args, name))
      return error(ErrorCode::invalid_argument, "the link is placed by an origin and has no DH row",
                   "Give origin = false to go back to a row.", path + "." + name);
  return {};
}

Result<void> read_mimic(const CommandContext& ctx, const Value& v, const Robot& robot,
                        std::int32_t index, Link& l, const std::string& path) {
  if (is_false(v)) {
    l.mimic.reset();
    return {};
  }
  const std::string unit = l.joint == JointKind::prismatic ? "m" : "rad";
  model::Mimic m;
  const Value* leader = v.as_map() ? v.as_map()->find("link") : nullptr;
  if (leader) {
    RMP_TRY_ASSIGN(m.link, read_link(robot, *leader, false, path + ".mimic.link"));
  }
  const bool leader_slides =
      leader && robot.links[static_cast<std::size_t>(m.link)].joint == JointKind::prismatic;
  const std::string own_unit = unit, leader_unit = leader_slides ? "m" : "rad";
  const Schema schema{
      needed("link", "any", "", "The link with the joint that is followed."),
      defaulted("ratio", "real", own_unit == leader_unit ? "" : own_unit + "/" + leader_unit, 1.0,
                "Factor of its value."),
      defaulted("offset", "real", unit, 0.0, "Added to the product.")};
  RMP_TRY_ASSIGN(const Map checked, read_map(ctx, schema, v, path + ".mimic"));
  if (m.link >= index)
    return error(ErrorCode::conflict, "a joint can only follow that of an earlier link",
                 "Order the links so that the followed one comes first.", path + ".mimic.link");
  m.ratio = real(checked, "ratio");
  m.offset = real(checked, "offset");
  l.mimic = m;
  return {};
}

/// Says which of the fields that are given have no effect, as the joint is of a kind that has no
/// use for them. They are kept: the joint may become another one.
void report_unused(CommandContext& ctx, const Map& args, const Link& l) {
  std::vector<std::string> unused;
  if (l.joint == JointKind::fixed)
    for (const ParamSpec& p : link_params()) {
      if (!has(args, p.name)) continue;
      const std::string group = notes_of(p).group;
      if (group == "Limits" || group == "Drive") unused.push_back(p.name);
    }
  if (l.joint == JointKind::fixed && has(args, "passive") && flag(args, "passive"))
    unused.emplace_back("passive");
  const bool has_axis =
      l.joint != JointKind::fixed && l.joint != JointKind::spherical && l.joint != JointKind::free;
  if (!has_axis && has(args, "axis")) unused.emplace_back("axis");
  if (unused.empty()) return;
  ctx.app.messages.post(Severity::warning, "unused_fields",
                        "link " + text::quote(l.name) + ": its joint is " +
                            std::string(model::joint_word(l.joint)) + ", for which " +
                            text::enumerate(unused) + (unused.size() == 1 ? " has" : " have") +
                            " no effect.",
                        "ioci");
}

/// Collects lengths and speeds that no link has in metres and radians, but may have in millimetres
/// and degrees.
void note_unlikely_sizes(const Map& args, const Link& l, const std::string& path) {
  constexpr double kLong = 10, kFar = 50;           // [m]
  constexpr double kFast = 60, kFastInMetres = 20;  // [rad/s], [m/s]
  const bool slides = l.joint == JointKind::prismatic;
  const auto note = [&](const char* name, const char* unit, double from) {
    const Value* v = args.find(name);
    if (v && v->is_number() && std::isfinite(v->number()) && std::fabs(v->number()) >= from)
      BareNumbers::unlikely(path + "." + name, v->number(), unit);
  };
  note("a", "m", kLong);
  note("d", "m", kLong);
  if (slides) {
    note("lower", "m", kFar);
    note("upper", "m", kFar);
  }
  note("max_velocity", slides ? "m/s" : "rad/s", slides ? kFastInMetres : kFast);
}

/// Applies checked link fields; `index` is the link's own, `robot` holds those before it.
Result<void> apply_link(CommandContext& ctx, const Map& args, const Robot& robot,
                        std::int32_t index, Link& l, const std::string& path) {
  RMP_TRY(set_fields(l, args));
  if (has(args, "parent")) {
    RMP_TRY_ASSIGN(l.parent, read_link(robot, *args.find("parent"), true, path + ".parent"));
    if (l.parent >= index)
      return error(ErrorCode::conflict, "the parent of a link must be an earlier link",
                   "Order the links so that parents come first.", path + ".parent");
  }
  RMP_TRY(apply_place(args, l, path));
  if (has(args, "mimic")) RMP_TRY(read_mimic(ctx, *args.find("mimic"), robot, index, l, path));
  note_unlikely_sizes(args, l, path);
  report_unused(ctx, args, l);
  if (l.lower > l.upper)
    return error(ErrorCode::invalid_argument,
                 "the lower limit " + text::print(l.lower) + " is above the upper limit " +
                     text::print(l.upper),
                 "Swap them.", path);
  RMP_TRY(read_mass(args, l.given, path + "."));
  if (has(args, "parts")) {
    RMP_TRY_ASSIGN(l.parts, read_bodies(ctx, *args.find("parts"), path + ".parts", "parts"));
  }
  return {};
}

JointKind kind_given(const Value* joint, JointKind otherwise) {
  const std::string* s = joint ? joint->as_string() : nullptr;
  return s ? model::joint_kind(*s).value_or(JointKind::revolute) : otherwise;
}

/// A row of robot.dh_table as the fields of a link: its link is the name, its type the joint.
Value link_of_row(Value given) {
  constexpr std::pair<const char*, const char*> kNames[] = {{"link", "name"}, {"type", "joint"}};
  Map* row = given.as_map();
  if (!row) return given;
  for (const auto& [there, here] : kNames) {
    const Value* v = row->find(there);
    if (!v || row->find(here)) continue;
    Value moved = *v;
    row->erase(there);
    row->set(here, std::move(moved));
  }
  return given;
}

/// A column of a table of rows: the field of a link, and the unit of its numbers if one is named.
struct Column {
  std::string field, unit;
};

/// "alpha", "alpha [deg]", "alpha (deg)" or "alpha deg".
Result<Column> read_column(const Value& given, const std::string& where) {
  std::string words = given.as_string() ? *given.as_string() : std::string();
  for (char& c : words)
    if (c == '[' || c == ']' || c == '(' || c == ')' || c == ',') c = ' ';
  const std::string_view all = text::trim(words);
  const auto blank = std::min(all.find(' '), all.size());
  Column column{std::string(all.substr(0, blank)), std::string(text::trim(all.substr(blank)))};
  if (column.field == "link") column.field = "name";
  if (column.field == "type") column.field = "joint";
  std::vector<std::string> known;
  for (const ParamSpec& p : link_params()) {
    known.push_back(p.name);
    if (p.name != column.field) continue;
    if (!column.unit.empty()) {
      if (const auto unit = units::parse(column.unit); !unit.ok()) {
        Error e = unit.error();
        return std::move(e).in(where);
      }
    }
    return column;
  }
  return unknown_name("column", column.field, known).in(where);
}

/// The entry of a row as the field's value. A number of `joint` is a type of robot.dh_table.
Result<Value> entry_of(const Column& column, const Value& entry, const std::string& where) {
  if (column.field == "joint" && entry.is_number()) {
    const double type = entry.number();
    for (std::size_t i = 0; i < model::kJointWords.size(); ++i)
      if (type == static_cast<double>(i)) return Value(std::string(model::kJointWords[i]));
    return error(ErrorCode::invalid_argument, entry.text() + " is not the type of a joint",
                 "0 is revolute, 1 is prismatic; or give its name.", where);
  }
  if (column.unit.empty() || !entry.is_number()) return entry;
  return Value(text::print(entry.number()) + " " + column.unit);
}

/// The numbers of a row, or none when it is a table of names.
const List* numbers_of(const Value& row, List& made) {
  if (const NumericArray* a = row.as_array()) {
    made.assign(a->data().begin(), a->data().end());
    return &made;
  }
  return row.as_list() && !row.as_list()->empty() ? row.as_list() : nullptr;
}

Error no_columns() {
  return error(
      ErrorCode::invalid_argument, "a row of numbers needs the names of its columns",
      "Textbooks order them differently. Give for example columns = {\"theta deg\", \"d\", "
      "\"a\", \"alpha deg\"}, or rows such as {d = 0.4, alpha = \"-90 deg\"}.");
}

}  // namespace

Result<List> links_given(const Value& links, const Value* columns) {
  const Value* rows = &links;
  const Value* names = columns;
  if (const Map* table = links.as_map()) {  // what robot.dh_table gives
    const Value* found = table->find("rows");
    if (found) rows = found;
    else if (!table->empty())
      return error(ErrorCode::invalid_argument, "links is a table with names, not a list",
                   "Give a list of links such as {{a = 0.3}, {a = 0.2}}.", "links");
    const Value* angles = table->find("angles");
    if (angles && angles->as_string() && *angles->as_string() == "degrees")
      return error(ErrorCode::invalid_argument, "the angles of this table are in degrees",
                   "Give robot.dh_table without angles = \"degrees\".", "links");
  }
  List out;
  if (const NumericArray* matrix = rows->as_array(); matrix && matrix->is_matrix()) {
    for (std::size_t i = 0; i < matrix->rows(); ++i) {
      List row;
      for (std::size_t j = 0; j < matrix->cols(); ++j) row.emplace_back(matrix->at(i, j));
      out.emplace_back(std::move(row));
    }
  } else if (rows->as_list()) {
    out = *rows->as_list();
  } else if (!rows->as_map()) {
    return error(ErrorCode::invalid_argument, rows->text() + " is not a list",
                 "Give a list of links such as {{a = 0.3}, {a = 0.2}}.", "links");
  }
  std::vector<Column> read;
  const List* given_names = names ? names->as_list() : nullptr;
  if (given_names)
    for (std::size_t i = 0; i < given_names->size(); ++i) {
      const std::string where = "columns[" + std::to_string(i + 1) + "]";
      RMP_TRY_ASSIGN(Column column, read_column((*given_names)[i], where));
      for (const Column& before : read)
        if (before.field == column.field)
          return error(ErrorCode::invalid_argument, "the column " + column.field + " appears twice",
                       {}, where);
      read.push_back(std::move(column));
    }
  for (std::size_t i = 0; i < out.size(); ++i) {
    List made;
    const List* numbers = numbers_of(out[i], made);
    if (!numbers) continue;
    const std::string where = "links[" + std::to_string(i + 1) + "]";
    if (read.empty()) return no_columns().in(where);
    if (numbers->size() != read.size())
      return error(ErrorCode::invalid_argument,
                   count_given(numbers->size(), "number") + "; there are " +
                       std::to_string(read.size()) + " columns",
                   "Give one number per column.", where);
    Map link;
    for (std::size_t j = 0; j < read.size(); ++j) {
      RMP_TRY_ASSIGN(Value entry, entry_of(read[j], (*numbers)[j], where + "." + read[j].field));
      link.set(read[j].field, std::move(entry));
    }
    out[i] = Value(std::move(link));
  }
  return out;
}

Result<void> append_link(CommandContext& ctx, Robot& r, Value given, const std::string& path) {
  std::unordered_set<std::string> names;
  for (const Link& l : r.links) names.insert(l.name);
  return append_link(ctx, r, std::move(given), path, names);
}

Result<void> append_link(CommandContext& ctx, Robot& r, Value given, const std::string& path,
                         std::unordered_set<std::string>& names) {
  given = link_of_row(std::move(given));
  const Map* raw = given.as_map();
  const JointKind kind = kind_given(raw ? raw->find("joint") : nullptr, JointKind::revolute);
  if (raw) {
    RMP_TRY_ASSIGN(given, ctx.expressions.read(link_schema(kind, true), Map(*raw), path));
  }
  RMP_TRY_ASSIGN(const Map checked, read_map(ctx, link_schema(kind, true), given, path));
  Link l;
  const auto index = static_cast<std::int32_t>(r.links.size());
  l.parent = index - 1;
  l.name = "link" + std::to_string(index + 1);
  RMP_TRY(apply_link(ctx, checked, r, index, l, path));
  if (!names.insert(l.name).second)
    return error(ErrorCode::conflict, "there are two links named " + text::quote(l.name),
                 "Names must be unique within a robot.", path);
  ctx.expressions.keep(r.parametric, l.name);
  r.links.push_back(std::move(l));
  return {};
}

namespace {

std::string name_in_document(const CommandContext& ctx, const Map& args) {
  return ctx.snapshot().find(ref(args, "id"))->name;
}

/// Removes the maker's axis of a link if its joint is locked or follows another. If the joint
/// slides instead of turning, or the other way round, the axis counts as the joint does. Both are
/// notes.
void fit_axis(CommandContext& ctx, const Map& args, Robot& r, std::int32_t index) {
  const Link& l = r.links[static_cast<std::size_t>(index)];
  const auto found = std::find_if(r.axes.begin(), r.axes.end(),
                                  [index](const auto& a) { return a.link == index; });
  if (found == r.axes.end()) return;
  const auto note = [&](const std::string& what) {
    ctx.app.messages.post(Severity::info, "maker_axis",
                          "robot " + text::quote(name_in_document(ctx, args)) + ": " + what +
                              " robot.set_axes sets others.",
                          "ioci");
  };
  const std::string axis = "the maker's axis " + text::quote(found->name),
                    joint = "the joint of link " + text::quote(l.name);
  if (!robotics::has_one_coordinate(l.joint) || l.mimic) {
    note(axis + " is removed, because " + joint + " has no independent value now.");
    r.axes.erase(found);
    return;
  }
  const auto unit = l.joint == JointKind::prismatic ? model::AxisUnit::mm : model::AxisUnit::deg;
  if (found->unit == unit) return;
  model::MakerAxis plain;
  plain.name = found->name;
  plain.link = index;
  plain.unit = unit;
  plain.external = found->external;
  *found = std::move(plain);
  note(axis + " counts as " + joint + " does, in " +
       (unit == model::AxisUnit::mm ? "mm." : "degrees."));
}

Result<Value> set_link(CommandContext& ctx, const Map& args) {
  const Robot& before = content<Robot>(ctx, args);
  RMP_TRY_ASSIGN(const std::int32_t index, read_link(before, *args.find("link"), false, "link"));
  // Units follow the joint's type, so what was given is read again for this link.
  const Link& old = before.links[static_cast<std::size_t>(index)];
  Map given;
  for (const ParamSpec& p : link_schema(old.joint, false))
    if (const Value* v = ctx.given(p.name)) given.set(p.name, *v);
  const Schema& schema = link_schema(kind_given(given.find("joint"), old.joint), false);
  const std::string where = "link " + text::quote(old.name);
  RMP_TRY_ASSIGN(given, ctx.expressions.read(schema, given, where));
  RMP_TRY_ASSIGN(const Map checked, read_map(ctx, schema, Value(given), where));
  return change_robot(ctx, args, [&](Robot& r) -> Result<void> {
    Link& l = r.links[static_cast<std::size_t>(index)];
    RMP_TRY(apply_link(ctx, checked, r, index, l, where));
    ctx.expressions.keep(r.parametric, l.name);
    fit_axis(ctx, args, r, index);
    for (std::size_t i = 0; i < r.links.size(); ++i)
      if (static_cast<std::int32_t>(i) != index && r.links[i].name == l.name)
        return error(ErrorCode::conflict, "there are two links named " + text::quote(l.name),
                     "Names must be unique within a robot.");
    if (checked.find("inertia")) report_inertia(ctx, name_in_document(ctx, args), l);
    if (checked.find("parts") && !l.parts.empty() && !l.visible)
      ctx.app.messages.post(Severity::info, "visible",
                            "robot " + text::quote(name_in_document(ctx, args)) + ", link " +
                                text::quote(l.name) +
                                " is not visible: its parts collide and have mass but are not "
                                "drawn. Give visible = true to draw them.",
                            "ioci");
    return {};
  });
}

Result<Value> add_link(CommandContext& ctx, const Map& args) {
  Map given;
  for (const ParamSpec& p : link_schema(JointKind::revolute, true))
    if (const Value* v = ctx.given(p.name)) given.set(p.name, *v);
  return change_robot(ctx, args, [&](Robot& r) -> Result<void> {
    RMP_TRY(append_link(ctx, r, Value(given), "link " + std::to_string(r.links.size() + 1)));
    report_inertia(ctx, name_in_document(ctx, args), r.links.back());
    // Named poses keep fitting: the new joint stands in neutral in them.
    const std::vector<double> neutral = robotics::neutral_coordinates(r);
    for (model::NamedPose& p : r.poses)
      for (std::size_t k = p.q.size(); k < neutral.size(); ++k) p.q.push_back(neutral[k]);
    return {};
  });
}

/// Joints that follow, tools and loops keep their links.
Result<void> nothing_holds(const Robot& r, std::int32_t index) {
  const std::string link = "link " + text::quote(r.links[static_cast<std::size_t>(index)].name);
  const auto held = [&](const std::string& what) {
    return error(ErrorCode::conflict, what + " holds " + link, "Remove that first.");
  };
  for (const Link& l : r.links)
    if (l.mimic && l.mimic->link == index)
      return error(ErrorCode::conflict,
                   "the joint of link " + text::quote(l.name) + " follows that of " + link,
                   "Set mimic = false for it first.");
  for (const auto& t : r.tools)
    if (t.link == index) return held("tool " + text::quote(t.name));
  for (const auto& t : r.attached)
    if (t.link == index) return held("the attached tool " + text::quote(t.name));
  for (const auto& l : r.loops)
    if (l.link_a == index || l.link_b == index) return held("loop " + text::quote(l.name));
  for (const model::MakerAxis& a : r.axes)
    for (const model::AxisCoupling& c : a.coupled)
      if (a.link != index && c.link == index) return held("axis " + text::quote(a.name));
  return {};
}

Result<Value> remove_link(CommandContext& ctx, const Map& args) {
  return change_robot(ctx, args, [&](Robot& r) -> Result<void> {
    RMP_TRY_ASSIGN(const std::int32_t index, read_link(r, *args.find("link"), false, "link"));
    for (const Link& l : r.links)
      if (l.parent == index)
        return error(ErrorCode::conflict,
                     "link " + text::quote(l.name) + " is mounted on link " +
                         text::quote(r.links[static_cast<std::size_t>(index)].name),
                     "Remove that first.");
    RMP_TRY(nothing_holds(r, index));
    const robotics::LinkJoints own = robotics::link_joints(r)[static_cast<std::size_t>(index)];
    for (model::NamedPose& p : r.poses)
      if (p.q.size() >= static_cast<std::size_t>(own.q + own.q_count))
        p.q.erase(p.q.begin() + own.q, p.q.begin() + own.q + own.q_count);
    const auto lower = [index](std::int32_t& link) {
      if (link > index) --link;
    };
    std::erase_if(r.axes, [index](const model::MakerAxis& a) { return a.link == index; });
    r.links.erase(r.links.begin() + index);
    for (Link& l : r.links) lower(l.parent);
    for (Link& l : r.links)
      if (l.mimic) lower(l.mimic->link);
    for (model::RobotTool& t : r.tools) lower(t.link);
    for (model::AttachedTool& t : r.attached) lower(t.link);
    for (model::LoopClosure& l : r.loops) {
      lower(l.link_a);
      lower(l.link_b);
    }
    for (model::MakerAxis& a : r.axes) {
      lower(a.link);
      for (model::AxisCoupling& c : a.coupled) lower(c.link);
    }
    return {};
  });
}

/// The type column of the original: 0 revolute, 1 prismatic, 2 fixed; the kinds it did not have
/// follow.
double type_number(JointKind kind) { return static_cast<double>(kind); }

Result<Value> dh_table(CommandContext& ctx, const Map& args) {
  const Robot& r = content<Robot>(ctx, args);
  std::vector<double> matrix;
  List rows;
  const double unit = in_degrees(args) ? std::numbers::pi / 180 : 1;
  for (const Link& l : r.links)
    if (l.origin)
      return error(ErrorCode::unsupported,
                   "link " + text::quote(l.name) + " is placed by an origin and has no DH row",
                   "robot.links returns origins and axes.", name_in(ctx, ref(args, "id")));
  for (const Link& l : r.links) {
    const double type = type_number(l.joint);
    const double alpha = l.row.alpha / unit, theta = l.row.theta / unit;
    matrix.insert(matrix.end(), {alpha, l.row.a, theta, l.row.d, type});
    Map row{{"link", l.name}, {"alpha", alpha}, {"a", l.row.a},
            {"theta", theta}, {"d", l.row.d},   {"type", model::joint_word(l.joint)}};
    // A row read elsewhere means the same there.
    const model::Convention own = l.convention.value_or(r.convention);
    if (own != model::Convention::dh) row.set("convention", "mdh");
    rows.emplace_back(std::move(row));
  }
  Map out{{"convention", r.convention == model::Convention::dh ? "dh" : "mdh"},
          {"columns", List{"alpha", "a", "theta", "d", "type"}},
          {"matrix", NumericArray(std::move(matrix), r.links.size(), 5)},
          {"rows", std::move(rows)}};
  if (in_degrees(args)) out.set("angles", "degrees");
  return Value(std::move(out));
}

Result<Value> links(CommandContext& ctx, const Map& args) {
  const Map all = describe_record(ctx.snapshot(), ref(args, "id"));
  return *all.find("links");
}

Result<Value> link_of(CommandContext& ctx, const Map& args) {
  const Robot& r = content<Robot>(ctx, args);
  RMP_TRY_ASSIGN(const std::int32_t index, read_link(r, *args.find("link"), false, "link"));
  const Map all = describe_record(ctx.snapshot(), ref(args, "id"));
  return (*all.find("links")->as_list())[static_cast<std::size_t>(index)];
}

Result<Value> link_row(CommandContext& ctx, const Map& args) {
  const Robot& r = content<Robot>(ctx, args);
  RMP_TRY_ASSIGN(const std::int32_t index, read_link(r, *args.find("link"), false, "link"));
  const Link& l = r.links[static_cast<std::size_t>(index)];
  if (l.origin)
    return error(ErrorCode::unsupported,
                 "link " + text::quote(l.name) + " is placed by an origin and has no DH row",
                 "robot.link returns its origin and axis.", name_in(ctx, ref(args, "id")));
  return Value(NumericArray({l.row.alpha, l.row.a, l.row.theta, l.row.d, type_number(l.joint)}));
}

std::string_view type_word(JointType type) {
  switch (type) {
    case JointType::revolute: return "revolute";
    case JointType::prismatic: return "prismatic";
    case JointType::spherical: return "spherical";
    case JointType::free: return "free";
  }
  return "";
}

Result<Value> joints(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto m, model_of(ctx, args));
  const auto axes = robotics::MakerAxes::of(content<Robot>(ctx, args));
  List out;
  for (const JointModel& j : m->joints) {
    Map row{{"name", j.name},
            {"type", type_word(j.type)},
            {"unit", j.type == JointType::revolute    ? "rad"
                     : j.type == JointType::prismatic ? "m"
                                                      : ""}};
    if (!j.is_coupled() && axes.ok())
      if (const PostAxis* axis = axes->of_entry(static_cast<std::size_t>(j.q_index)))
        row.set("axis", std::string(axis->name));
    if (j.is_coupled()) {
      row.set("follows", m->joints[static_cast<std::size_t>(j.coupling.of)].name);
      row.set("ratio", j.coupling.ratio);
      row.set("offset", j.coupling.offset);
    }
    if (j.passive) row.set("passive", true);
    if (j.spring.stiffness > 0) {
      row.set("stiffness", j.spring.stiffness);
      row.set("rest", j.spring.rest);
    }
    const std::pair<const char*, double> limits[] = {{"lower", j.lower},
                                                     {"upper", j.upper},
                                                     {"max_velocity", j.max_velocity},
                                                     {"max_acceleration", j.max_acceleration},
                                                     {"max_jerk", j.max_jerk},
                                                     {"max_force", j.max_force}};
    for (const auto& [name, v] : limits)
      if (std::isfinite(v)) row.set(name, v);
    out.emplace_back(std::move(row));
  }
  return Value(std::move(out));
}

Result<Value> coordinates(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto m, model_of(ctx, args));
  const auto units = robotics::coordinate_units(*m);
  const auto neutral = robotics::neutral_coordinates(*m);
  List out;
  for (const JointModel& j : m->joints) {
    if (j.is_coupled()) continue;
    constexpr const char* kParts[] = {".x", ".y", ".z", ".w", ".x", ".y", ".z"};
    constexpr const char* kFree[] = {".px", ".py", ".pz", ".w", ".x", ".y", ".z"};
    for (std::int32_t k = 0; k < coordinate_count(j.type); ++k) {
      const auto at = static_cast<std::size_t>(j.q_index + k);
      const std::string part = j.type == JointType::free        ? kFree[k]
                               : j.type == JointType::spherical ? kParts[k + 3]
                                                                : "";
      out.emplace_back(Map{{"name", j.name + part},
                           {"unit", std::string(units[at])},
                           {"neutral", neutral[at]},
                           {"passive", j.passive}});
    }
  }
  return Value(std::move(out));
}

}  // namespace

RMP_COMMANDS(robot_link_commands) {
  std::vector<CommandSpec> all;
  const ParamSpec link = needed("link", "any", "", "Number, 1 is the first, or name of the link.");
  const char* const by_type =
      "Limits are in rad, rad/s, rad/s^2 and N m for a revolute joint, in m, m/s, m/s^2 and N for "
      "a prismatic one.";
  Schema add_params{self("robot")}, link_params_of_set{self("robot"), link};
  for (const ParamSpec& p : units_by_joint(link_params())) {
    add_params.push_back(p);
    link_params_of_set.push_back(p);
  }
  param_named(add_params, "joint").default_value = Value(model::kJointWords[0]);
  all.push_back({.name = "robot.add_link",
                 .classic = "",
                 .summary = "Adds a link at the end of a robot's list.",
                 .details = std::string(by_type) + " Named poses get 0 for its joint.",
                 .example = with_arm("arm:add_link{name = \"rail\", joint = \"prismatic\", d = "
                                     "0.1, lower = 0, upper = \"200 mm\"}\nassert(arm:dof() == 7)"),
                 .params = std::move(add_params),
                 .returns = {},
                 .effect = Effect::edits,
                 .run = add_link,
                 .takes_expressions = true});
  all.push_back({.name = "robot.set_link",
                 .classic = "",
                 .summary = "Changes the given properties of a link.",
                 .details = by_type,
                 .example = with_arm("arm:set_link{link = 2, a = \"500 mm\", upper = \"120 "
                                     "deg\"}\nassert(arm:link(2).a == 0.5)"),
                 .params = std::move(link_params_of_set),
                 .returns = {},
                 .effect = Effect::edits,
                 .run = set_link,
                 .takes_expressions = true});
  all.push_back(
      {.name = "robot.remove_link",
       .classic = "",
       .summary = "Removes a link that has no child links and that no tools or parts refer to.",
       .details = "Named poses lose the value of its joint, and the maker's axes lose its axis.",
       .example = with_arm("arm:remove_link(6)\nassert(arm:dof() == 5)"),
       .params = {self("robot"), link},
       .returns = {},
       .effect = Effect::edits,
       .run = remove_link});
  all.push_back(
      {.name = "robot.dh_table",
       .classic = "PRobot mGetDHP(angles=degrees)|PRobot LLRL mGetDHP",
       .summary = "Returns the Denavit-Hartenberg table of a robot.",
       .details =
           "The matrix has one row per link with the columns of the 2006 program: alpha, a [m], "
           "theta, d [m], type (0 revolute, 1 prismatic, 2 fixed, 3 universal, 4 cylindrical, 5 "
           "planar, 6 spherical, 7 free). The joint's variable is added to theta or d.",
       .example = with_arm(
           "local t = arm:dh_table()\nassert(t.rows[1].d == 0.4 and t.columns[1] == \"alpha\")"),
       .params = {self("robot"), angle_unit()},
       .returns = {"map",
                   "",
                   "",
                   {field("convention", "string", "", "dh or mdh."),
                    field("columns", "list", "", "Names of the matrix' columns."),
                    field("angles", "string", "", "\"degrees\" for columns in degrees."),
                    field("matrix", "matrix", "", "One row per link."),
                    field("rows", "list", "", "The same values by name.")}},
       .effect = Effect::reads,
       .run = dh_table});
  all.push_back({.name = "robot.links",
                 .classic = "",
                 .summary = "Lists the links with all their fields.",
                 .details = "Limits that are missing are unlimited.",
                 .example = with_arm("assert(#arm:links() == 6)"),
                 .params = {self("robot")},
                 .returns = {"list", "", "Tables with the fields of robot.add_link.", {}},
                 .effect = Effect::reads,
                 .run = links});
  all.push_back({.name = "robot.link",
                 .classic = "PRobot Link Get",
                 .summary = "Returns all fields of one link.",
                 .details = "Classic: `PRobot <id> Link <i> Get`.",
                 .example = with_arm("assert(arm:link(1).d == 0.4)"),
                 .params = {self("robot"), link},
                 .returns = {"map", "", "The fields of robot.add_link.", {}},
                 .effect = Effect::reads,
                 .run = link_of});
  all.push_back({.name = "robot.link_row",
                 .classic = "",
                 .summary = "Returns alpha, a, theta, d and type of one link.",
                 .details = "robot.link_parameters returns its limits as well.",
                 .example = with_arm("assert(arm:link_row(2)[2] == 0.45)"),
                 .params = {self("robot"), link},
                 .returns = {"array", "", "alpha [rad], a [m], theta [rad], d [m], type.", {}},
                 .effect = Effect::reads,
                 .run = link_row});
  all.push_back(
      {.name = "robot.joints",
       .classic = "",
       .summary = "Lists the moving joints with type and limits.",
       .details =
           "A universal, cylindrical or planar joint is a sequence of joints of one coordinate. "
           "Limits that are missing are unlimited.",
       .example = with_arm("assert(arm:joints()[1].upper == 3)"),
       .params = {self("robot")},
       .returns = {"list",
                   "",
                   "",
                   {field("name", "string", "", "Name of its link."),
                    field("type", "string", "", "revolute, prismatic, spherical or free."),
                    field("unit", "string", "", "rad or m."),
                    field("axis", "string", "", "The maker's axis, if known."),
                    field("lower", "real", "rad or m", "Least value."),
                    field("upper", "real", "rad or m", "Greatest value."),
                    field("max_velocity", "real", "rad/s or m/s", "Greatest speed."),
                    field("max_acceleration", "real", "rad/s^2 or m/s^2", "Greatest acceleration."),
                    field("max_jerk", "real", "rad/s^3 or m/s^3", "Greatest jerk."),
                    field("max_force", "real", "N m or N", "Greatest torque or force."),
                    field("follows", "string", "", "The joint it follows, with ratio and offset."),
                    field("passive", "bool", "", "True if it has no motor."),
                    field("stiffness", "real", "N m/rad or N/m",
                          "Stiffness of its spring, relaxed at rest.")}},
       .effect = Effect::reads,
       .run = joints});
  all.push_back(
      {.name = "robot.coordinates",
       .classic = "",
       .summary = "Lists the numbers of a configuration q in order.",
       .details = "A revolute or prismatic joint has one, a universal or cylindrical one two, a "
                  "planar one three, a spherical one a quaternion w x y z, a free one x y z and a "
                  "quaternion. A joint that follows another one has none.",
       .example = with_arm("arm:add_link{name = \"ball\", joint = \"spherical\"}\nlocal c = "
                           "arm:coordinates()\nassert(#c == 10 and c[7].name == \"ball.w\" and "
                           "c[7].neutral == 1)"),
       .params = {self("robot")},
       .returns = {"list",
                   "",
                   "",
                   {field("name", "string", "", "Name of the link, and which of its coordinates."),
                    field("unit", "string", "", "rad, m, or empty for a quaternion."),
                    field("neutral", "real", "", "Value at rest, before any motion."),
                    field("passive", "bool", "", "True if its joint has no motor.")}},
       .effect = Effect::reads,
       .run = coordinates});
  return all;
}

}  // namespace robomosp::ioci
