// SPDX-License-Identifier: GPL-3.0-or-later
// The lanes of the timeline: which columns are plotted, and what other recordings lie over them.
#include <algorithm>
#include <numbers>
#include <set>
#include <utility>

#include <QVariant>

#include "viewer/desktop/settings.h"
#include "viewer/desktop/values.h"
#include "viewer/timeline/timeline.h"
#include "viewer/timeline/variables.h"
#include "viewer/widgets/field.h"

namespace robomosp::viewer {
namespace {

constexpr std::size_t kMostLanes = 12;
/// Columns of one quantity that are plotted without being asked for.
constexpr std::size_t kMostUsual = 8;

struct ShownUnit {
  double scale = 1;
  QString text;
};

/// Angles in degrees and lengths in millimetres, as fields show them.
ShownUnit shown_unit(const std::string& unit) {
  constexpr double kDegrees = 180 / std::numbers::pi;
  if (unit == "rad" || unit.starts_with("rad/"))
    return {kDegrees, unit_text("deg" + unit.substr(3))};
  if (unit == "m" || unit.starts_with("m/")) return {1e3, unit_text("m" + unit)};
  return {1, unit_text(unit)};
}

/// "Torque" of "torque of joint 3 (elbow)".
QString quantity_of(const ColumnInfo& column) {
  QString doc = shown(column.doc);
  const auto of = doc.indexOf(" of ");
  doc = of > 0 ? doc.left(of) : QString();
  if (doc.isEmpty()) return {};
  doc[0] = doc[0].toUpper();
  return doc;
}

}  // namespace

QString Timeline::lanes_key() const {
  if (!data_) return "lanes/none";
  QString kind = data_->is_run() ? QString("run") : shown(data_->command());
  if (kind.isEmpty()) kind = "given";
  return "lanes/" + kind.replace('.', '_');
}

Timeline::LaneSpecs Timeline::default_lanes() const {
  LaneSpecs out;
  if (!data_) return out;
  // Columns of one quantity are a lane: torques and speeds if there are any, else positions.
  std::vector<std::pair<std::string, std::vector<std::string>>> groups;
  for (const ColumnInfo& c : data_->columns()) {
    const std::string stem = stem_of(c.name);
    if (stem.empty()) continue;
    if (groups.empty() || groups.back().first != stem) groups.push_back({stem, {}});
    groups.back().second.push_back(c.name);
  }
  const auto add = [&](std::string_view wanted) {
    for (auto& [stem, columns] : groups) {
      const bool is_it = stem == wanted || stem.ends_with("." + std::string(wanted));
      if (!is_it || out.size() >= 4) continue;
      if (columns.size() > kMostUsual) columns.resize(kMostUsual);
      out.push_back(columns);
    }
  };
  add("tau");
  add("qd");
  if (out.empty()) add("q");
  if (!out.empty()) return out;
  for (const ColumnInfo& c : data_->columns())
    if (c.name.ends_with(".z") || c.name == "clearance") {
      if (out.empty()) out.emplace_back();
      if (out.front().size() < kMostUsual) out.front().push_back(c.name);
    }
  if (!out.empty()) return out;
  for (const ColumnInfo& c : data_->columns())
    if (c.name != "time" && out.size() < 2) out.push_back({c.name});
  return out;
}

void Timeline::load_specs() {
  has_specs_ = true;
  specs_.clear();
  const QVariant kept = settings_.timeline(lanes_key());
  for (const QString& lane : kept.toStringList()) {
    std::vector<std::string> columns;
    for (const QString& name : lane.split(','))
      if (data_->column(utf8(name))) columns.push_back(utf8(name));
    if (!columns.empty() && specs_.size() < kMostLanes) specs_.push_back(std::move(columns));
  }
  // A kind that was emptied on purpose stays empty.
  if (specs_.empty() && !(kept.isValid() && kept.toStringList().isEmpty()))
    specs_ = default_lanes();
  want_columns();
}

void Timeline::keep_specs() {
  QStringList lanes;
  for (const auto& lane : specs_) {
    QStringList names;
    for (const std::string& name : lane) names += shown(name);
    lanes += names.join(',');
  }
  settings_.set_timeline(lanes_key(), lanes);
  want_columns();
}

void Timeline::want_columns() {
  std::set<std::string> wanted;
  for (const auto& lane : specs_) wanted.insert(lane.begin(), lane.end());
  if (data_) data_->want(wanted);
  for (const auto& other : compared_) other->want(wanted);
  lanes_timer_.start();
}

void Timeline::show_lanes() {
  if (!data_) return lanes_->show_lanes({});
  const std::vector<Lane>& old = lanes_->lanes();
  const auto old_series = [&](const std::string& key) -> std::shared_ptr<const Series> {
    for (const Lane& lane : old)
      for (const Curve& curve : lane.curves)
        if (curve.key == key) return curve.series;
    return nullptr;
  };
  std::vector<Lane> lanes;
  for (const auto& spec : specs_) {
    Lane lane;
    std::string stem, unit;
    QString quantity;
    bool is_one_group = true, is_first = true;
    for (const std::string& name : spec) {
      const ColumnInfo* info = data_->column(name);
      if (!info) continue;
      const std::string own = stem_of(name);
      if (is_first) {
        stem = own;
        unit = info->unit;
        quantity = quantity_of(*info);
      }
      is_one_group = is_one_group && !own.empty() && own == stem && info->unit == unit;
      is_first = false;
    }
    if (is_first) {
      // A column that was just computed, or that this recording lacks: the lane keeps its place.
      lane.title = shown(spec.front()) + " (no such column)";
      lanes.push_back(std::move(lane));
      continue;
    }
    const bool has_numbers = is_one_group && spec.size() > 1;
    for (const std::string& name : spec) {
      const ColumnInfo* info = data_->column(name);
      if (!info) continue;
      Curve curve;
      curve.key = name;
      curve.name = has_numbers ? shown(name.substr(stem.size())) : shown(name);
      curve.scale = shown_unit(info->unit).scale;
      curve.is_step = name.starts_with("signal.");
      const std::size_t number =
          has_numbers ? static_cast<std::size_t>(std::stoul(name.substr(stem.size()))) : 0;
      curve.colour = number > 0 ? number - 1 : lane.curves.size();
      // Until the samples of a new run are there, the old ones are shown, dimmed.
      curve.series = data_->series(name);
      if (!curve.series) curve.series = old_series(curve.key);
      lane.curves.push_back(std::move(curve));
    }
    const std::size_t own_curves = lane.curves.size();
    for (const auto& other : compared_)
      for (std::size_t i = 0; i < own_curves; ++i) {
        const std::string name = lane.curves[i].key;
        if (!other->column(name)) continue;
        Curve curve = lane.curves[i];
        curve.key = "#" + std::to_string(other->source().number) + " " + name;
        curve.name = "#" + QString::number(other->source().number) + " " + lane.curves[i].name;
        curve.base = static_cast<int>(i);
        curve.series = other->series(name);
        if (!curve.series) curve.series = old_series(curve.key);
        lane.curves.push_back(std::move(curve));
      }
    const bool is_single = spec.size() == 1;
    QString title =
        is_one_group && !is_single && !quantity.isEmpty()
            ? quantity
            : (is_single ? shown(spec.front()) : (is_one_group ? shown(stem) : QString("Several")));
    if (is_one_group && stem.find('.') != std::string::npos)
      title = shown(stem.substr(0, stem.find('.'))) + ": " + title;
    const ColumnInfo* first = data_->column(spec.front());
    const QString text = first ? shown_unit(first->unit).text : QString();
    const bool is_one_unit = std::all_of(spec.begin(), spec.end(), [&](const std::string& name) {
      const ColumnInfo* info = data_->column(name);
      return !info || !first || info->unit == first->unit;
    });
    lane.has_one_unit = is_one_unit;
    lane.title = !is_one_unit || text.isEmpty() ? title : title + " [" + text + "]";
    lanes.push_back(std::move(lane));
  }
  // The same curves with more samples keep their places.
  bool is_same = lanes.size() == old.size();
  for (std::size_t l = 0; is_same && l < lanes.size(); ++l) {
    is_same = lanes[l].title == old[l].title && lanes[l].curves.size() == old[l].curves.size();
    for (std::size_t c = 0; is_same && c < lanes[l].curves.size(); ++c)
      is_same = lanes[l].curves[c].key == old[l].curves[c].key &&
                lanes[l].curves[c].series == old[l].curves[c].series;
  }
  if (is_same) lanes_->refresh();
  else lanes_->show_lanes(std::move(lanes));
  show_time();
}

void Timeline::add_columns(const std::vector<std::string>& columns, bool into_present_lane) {
  if (!data_) return;
  std::vector<std::string> known;
  for (const std::string& name : columns) {
    if (data_->column(name)) known.push_back(name);
    else
      desk_.failed(error(ErrorCode::unknown_name, "the recording has no column \"" + name + "\"",
                         "The button Variable lists its columns."));
  }
  if (known.empty()) return;
  const auto present = static_cast<std::size_t>(std::max(0, lanes_->current_lane()));
  if (into_present_lane && present < specs_.size()) {
    for (const std::string& name : known)
      if (std::find(specs_[present].begin(), specs_[present].end(), name) == specs_[present].end())
        specs_[present].push_back(name);
  } else if (specs_.size() >= kMostLanes) {
    return desk_.failed(error(ErrorCode::invalid_argument,
                              "there are " + std::to_string(kMostLanes) + " lanes already",
                              "Remove one, or plot into an existing lane."));
  } else {
    specs_.push_back(std::move(known));
  }
  keep_specs();
}

void Timeline::remove_lane(int lane) {
  if (lane < 0 || static_cast<std::size_t>(lane) >= specs_.size()) return;
  specs_.erase(specs_.begin() + lane);
  keep_specs();
}

void Timeline::move_lane(int lane, int by) {
  const int to = lane + by, count = static_cast<int>(specs_.size());
  if (lane < 0 || lane >= count || to < 0 || to >= count) return;
  std::swap(specs_[static_cast<std::size_t>(lane)], specs_[static_cast<std::size_t>(to)]);
  keep_specs();
}

void Timeline::split_lane(int lane) {
  if (lane < 0 || static_cast<std::size_t>(lane) >= specs_.size()) return;
  const std::vector<std::string> columns = specs_[static_cast<std::size_t>(lane)];
  if (specs_.size() + columns.size() - 1 > kMostLanes)
    return desk_.failed(error(ErrorCode::invalid_argument,
                              "there would be more than " + std::to_string(kMostLanes) + " lanes",
                              "Remove some first."));
  specs_.erase(specs_.begin() + lane);
  for (std::size_t i = 0; i < columns.size(); ++i)
    specs_.insert(specs_.begin() + lane + static_cast<std::ptrdiff_t>(i), {columns[i]});
  keep_specs();
}

void Timeline::compare(const Handle& recording, bool on) {
  if (!data_ || recording == data_->source()) return;
  std::erase_if(compared_, [&](const auto& c) { return c->source() == recording; });
  if (on) {
    compared_.push_back(std::make_unique<RecordingData>(desk_, recording));
    compared_.back()->described.add(this, [this] { lanes_timer_.start(); });
    compared_.back()->filled.add(this, [this] { lanes_timer_.start(); });
  }
  want_columns();
}

void Timeline::watch_expression(const QString& expression, QString name, const QString& unit) {
  if (!data_) return;
  if (data_->is_run())
    return picker_->show_fault(
        "A live run has no computed columns. Make a recording of it first: run.recording(id).");
  for (int i = 1; name.isEmpty(); ++i)
    if (const QString free = "value" + QString::number(i); !data_->column(utf8(free))) name = free;
  Map args{{"id", data_->source()}, {"name", utf8(name)}, {"expression", utf8(expression)}};
  if (!unit.isEmpty()) args.set("unit", utf8(unit));
  const QPointer<Timeline> self(this);
  const Handle source = data_->source();
  desk_.act("recording.watch", std::move(args), [self, name, source](const Result<Value>& r) {
    if (!self || !self->data_ || self->data_->source() != source) return;
    if (!r.ok()) return self->picker_->show_fault(shown(r.error().sentence()));
    self->picker_->close();
    // Its lane is filled when the new table has been described.
    self->specs_.push_back({utf8(name)});
    self->keep_specs();
  });
}

}  // namespace robomosp::viewer
