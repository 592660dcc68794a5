// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/timeline/recording_data.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "viewer/desktop/values.h"

namespace robomosp::viewer {
namespace {

using ioci::Topic;

constexpr int kLoadAfterMs = 15;
constexpr int kStaleAfterMs = 120;

/// Samples that were read beside the window.
struct Loaded {
  TimesPtr times;
  std::map<std::string, std::shared_ptr<const Series>> series;
};

}  // namespace

RecordingData::RecordingData(Desk& desk, Handle source, QObject* parent)
    : QObject(parent), desk_(desk), source_(std::move(source)) {
  load_timer_.setSingleShot(true);
  load_timer_.setInterval(kLoadAfterMs);
  stale_timer_.setSingleShot(true);
  stale_timer_.setInterval(kStaleAfterMs);
  connect(&load_timer_, &QTimer::timeout, this, [this] { is_run() ? load_rows() : load(); });
  connect(&stale_timer_, &QTimer::timeout, this, [this] { ask_stale(); });
  desk_.events.add(this, [this](const ioci::Event& e) { take(e); });
  if (is_run()) {
    run_times_ = std::make_shared<Numbers64>();
    times_ = run_times_;
  }
  describe();
  if (!is_run()) {
    ask_stale();
    ask_bands();
  }
}

const ColumnInfo* RecordingData::column(const std::string& name) const {
  const auto at = std::find_if(columns_.begin(), columns_.end(),
                               [&](const ColumnInfo& c) { return c.name == name; });
  return at == columns_.end() ? nullptr : &*at;
}

std::optional<std::pair<double, double>> RecordingData::range() const {
  if (!times_ || times_->empty()) return std::nullopt;
  return std::pair(times_->front(), times_->back());
}

std::shared_ptr<const Series> RecordingData::series(const std::string& column) const {
  if (is_run()) {
    const auto at = run_series_.find(column);
    return at == run_series_.end() ? nullptr : at->second;
  }
  const auto at = series_.find(column);
  return at == series_.end() ? nullptr : at->second;
}

void RecordingData::describe() {
  // Answers may come after this has ended: they find no owner then.
  const QPointer<RecordingData> self(this);
  desk_.ask(is_run() ? "run.columns" : "recording.columns", {{"id", source_}},
            [self](const Result<Value>& r) {
              if (!self) return;
              if (!r.ok()) {
                self->is_gone_ = true;
                return self->described();
              }
              self->columns_.clear();
              for (const Value& v : list_of(*r)) {
                const Map& row = map_of(v);
                self->columns_.push_back(
                    {text_at(row, "name"), text_at(row, "unit"), text_at(row, "doc")});
              }
              self->described();
              self->load_timer_.start();
            });
  desk_.ask(is_run() ? "run.list" : "recording.list", {}, [self](const Result<Value>& r) {
    if (!self || !r.ok()) return;
    for (const Value& v : list_of(*r))
      if (handle_at(map_of(v), self->is_run() ? "id" : "recording") == self->source_)
        self->title_ = shown(text_at(map_of(v), "title"));
    self->described();
  });
}

void RecordingData::ask_stale() {
  if (is_run()) return;
  const QPointer<RecordingData> self(this);
  desk_.ask("recording.is_stale", {{"id", source_}}, [self](const Result<Value>& r) {
    if (!self || !r.ok()) return;
    const Map& m = map_of(*r);
    self->is_stale_ = flag_at(m, "stale");
    self->can_refresh_ = flag_at(m, "can_refresh");
    self->command_ = text_at(m, "command");
    QStringList changed;
    for (const Value& v : list_at(m, "changed"))
      if (const std::string* s = v.as_string()) changed += shown(*s);
    self->stale_text_ = changed.join(", ");
    if (!self->can_refresh_) self->stale_text_ = shown(text_at(m, "why_not"));
    self->described();
  });
}

void RecordingData::ask_bands() {
  if (is_run()) return;
  const QPointer<RecordingData> self(this);
  ++loads_;
  desk_.ask("recording.bands", {{"id", source_}}, [self](const Result<Value>& r) {
    if (!self) return;
    --self->loads_;
    if (r.ok()) self->take_bands(list_of(*r));
    self->filled();
  });
}

void RecordingData::take_bands(const List& rows) {
  bands_.clear();
  for (const Value& v : rows) {
    const Map& row = map_of(v);
    Band band;
    band.name = text_at(row, "name");
    band.label = shown(text_at(row, "label"));
    band.is_known = flag_at(row, "known");
    band.why = shown(text_at(row, "why"));
    band.note = shown(text_at(row, "note"));
    band.is_signal = text_at(row, "kind") == "signal";
    band.is_digital = flag_at(row, "digital");
    band.times = numbers_at(row, "times");
    band.values = numbers_at(row, "values");
    for (const Value& each : list_at(row, "spans")) {
      const Map& s = map_of(each);
      BandSpan span;
      span.from = number_at(s, "from");
      span.to = number_at(s, "to");
      span.at = s.find("at") ? number_at(s, "at") : span.from;
      span.level = text_at(s, "level");
      span.text = shown(text_at(s, "text"));
      span.record = handle_at(s, "record");
      span.path = text_at(s, "path");
      span.column = text_at(s, "column");
      band.spans.push_back(std::move(span));
    }
    bands_.push_back(std::move(band));
  }
}

void RecordingData::want(const std::set<std::string>& columns) {
  wanted_ = columns;
  std::erase_if(series_, [&](const auto& each) { return !wanted_.contains(each.first); });
  if (is_run()) {
    // Rows are read with all their columns: one that is new begins with the first row.
    bool is_new = false;
    for (const std::string& name : wanted_) is_new = is_new || !run_series_.contains(name);
    std::erase_if(run_series_, [&](const auto& each) { return !wanted_.contains(each.first); });
    if (is_new) {
      run_times_->clear();
      run_series_.clear();
      run_restarts_ = 0;
    }
  }
  load_timer_.start();
}

void RecordingData::load() {
  std::vector<std::string> missing;
  for (const std::string& name : wanted_)
    if (!series_.contains(name) && column(name)) missing.push_back(name);
  const bool needs_times = !times_;
  if ((missing.empty() && !needs_times) || columns_.empty() || !column("time")) return;
  if (loads_ > 0 && is_load_wanted_) return;
  is_load_wanted_ = true;
  ++loads_;
  const QPointer<RecordingData> self(this);
  auto loaded = std::make_shared<Loaded>();
  loaded->times = times_;
  ioci::Application& app = desk_.application();
  // On the client's thread: reading a million samples and the extremes of their blocks takes a
  // few milliseconds, which the window must not wait for.
  (void)desk_.client().run(
      "samples of the timeline",
      [loaded, missing, source = source_, &app](ioci::Session& session) -> Result<Value> {
        const auto read = [&](const std::string& name) -> Result<Numbers64> {
          RMP_TRY_ASSIGN(const Value v, app.dispatch(session, "recording.values",
                                                     Map{{"id", source}, {"columns", List{name}}}));
          const NumericArray* a = v.as_array();
          if (!a || a->is_matrix())
            return error(ErrorCode::invalid_argument, "\"" + name + "\" is not one column");
          return Numbers64(a->data().begin(), a->data().end());
        };
        if (!loaded->times) {
          RMP_TRY_ASSIGN(Numbers64 times, read("time"));
          loaded->times = std::make_shared<const Numbers64>(std::move(times));
        }
        for (const std::string& name : missing) {
          RMP_TRY_ASSIGN(Numbers64 values, read(name));
          loaded->series[name] = std::make_shared<const Series>(loaded->times, std::move(values));
        }
        return Value();
      },
      [self, loaded, generation = generation_](const Result<Value>& r) {
        if (!self) return;
        --self->loads_;
        self->is_load_wanted_ = false;
        if (generation != self->generation_) return self->load_timer_.start();
        // A column that is gone meanwhile: the new description has the others.
        if (!r.ok()) return self->described();
        const bool is_first = !self->times_;
        self->times_ = loaded->times;
        for (auto& [name, series] : loaded->series)
          if (self->wanted_.contains(name)) self->series_[name] = series;
        if (is_first) self->described();
        self->filled();
        self->load_timer_.start();  // what was wanted meanwhile
      });
}

void RecordingData::load_rows() {
  if (is_reading_rows_) {
    has_more_rows_ = true;
    return;
  }
  if (columns_.empty()) return;
  is_reading_rows_ = true;
  has_more_rows_ = false;
  List names{Value("time")};
  for (const std::string& name : wanted_)
    if (column(name)) names.emplace_back(name);
  Map args{{"id", source_}, {"from", run_times_->size() + 1}, {"columns", std::move(names)}};
  if (run_restarts_ > 0 || !run_times_->empty()) args.set("restarts", run_restarts_);
  const QPointer<RecordingData> self(this);
  const std::set<std::string> asked = wanted_;
  desk_.ask("run.rows", std::move(args), [self, asked](const Result<Value>& r) {
    if (!self) return;
    self->is_reading_rows_ = false;
    if (!r.ok()) {
      self->is_gone_ = true;
      return self->described();
    }
    if (asked != self->wanted_) return self->load_timer_.start();
    const Map& m = map_of(*r);
    const auto from = static_cast<std::size_t>(whole_at(m, "from"));
    const auto count = static_cast<std::size_t>(whole_at(m, "count"));
    const auto rows = static_cast<std::size_t>(whole_at(m, "rows"));
    self->run_restarts_ = static_cast<std::size_t>(whole_at(m, "restarts"));
    const Value* columns = m.find("columns");
    if (!columns || from == 0) return;
    // After a restart rows are given again from the first one that changed.
    if (from - 1 < self->run_times_->size()) {
      self->run_times_->resize(from - 1);
      for (auto& [name, series] : self->run_series_) series->cut(from - 1);
    }
    const std::vector<double> times = numbers_at(map_of(*columns), "time");
    self->run_times_->insert(self->run_times_->end(), times.begin(), times.end());
    for (const std::string& name : asked) {
      auto& series = self->run_series_[name];
      if (!series) series = std::make_shared<Series>(self->times_, Numbers64{});
      const std::vector<double> values = numbers_at(map_of(*columns), name);
      series->append(values.data(), values.size());
    }
    if (count > 0) self->filled();
    if (from - 1 + count < rows || self->has_more_rows_) self->load_timer_.start();
  });
}

void RecordingData::take(const ioci::Event& event) {
  switch (event.topic) {
    case Topic::recording: {
      if (is_run() || !event.recording || event.recording->number != source_.number) return;
      using What = recording::RecordingChange::What;
      if (event.recording->what == What::removed) {
        is_gone_ = true;
        return described();
      }
      // The old samples stay until the new ones are there.
      ++generation_;
      times_.reset();
      series_.clear();
      load_timer_.start();
      describe();
      ask_stale();
      ask_bands();
      break;
    }
    case Topic::run:
      if (is_run() && event.run && event.run->run == source_.number) load_timer_.start();
      break;
    case Topic::change:
      if (!is_run() && !stale_timer_.isActive()) stale_timer_.start();
      break;
    default: break;
  }
}

}  // namespace robomosp::viewer
