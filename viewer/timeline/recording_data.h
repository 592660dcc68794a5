// SPDX-License-Identifier: GPL-3.0-or-later
// RecordingData: what the timeline shows of one recording or live run: columns, bands, the wanted
// series, and whether it is out of date. It follows the document (layer: GUI).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <QObject>
#include <QString>
#include <QTimer>

#include "viewer/desktop/desk.h"
#include "viewer/desktop/listeners.h"
#include "viewer/plots/series.h"

namespace robomosp::viewer {

struct ColumnInfo {
  std::string name, unit, doc;
};

struct BandSpan {
  double from = 0, to = 0;  ///< [s]
  double at = 0;            ///< its worst time [s]
  std::string level;        ///< as recording.bands gives it
  QString text;
  std::optional<Handle> record{};  ///< that it is about
  std::string path{};              ///< of its part
  std::string column{};
};

struct Band {
  std::string name;
  QString label;
  bool is_known = true;
  QString why, note;
  std::vector<BandSpan> spans;
  /// A signal: its values from each time on.
  bool is_signal = false, is_digital = false;
  std::vector<double> times, values;
};

/// [GUI thread]
class RecordingData : public QObject {
 public:
  /// Of a recording or a live run.
  RecordingData(Desk& desk, Handle source, QObject* parent = nullptr);

  /// The columns with samples that are needed; others of earlier calls are freed.
  void want(const std::set<std::string>& columns);
  /// Null until it is loaded.
  [[nodiscard]] std::shared_ptr<const Series> series(const std::string& column) const;

  [[nodiscard]] const Handle& source() const { return source_; }
  [[nodiscard]] bool is_run() const { return source_.kind == "run"; }
  [[nodiscard]] const QString& title() const { return title_; }
  [[nodiscard]] const std::vector<ColumnInfo>& columns() const { return columns_; }
  [[nodiscard]] const ColumnInfo* column(const std::string& name) const;
  [[nodiscard]] const std::vector<Band>& bands() const { return bands_; }
  /// First and last time; nothing without samples [s].
  [[nodiscard]] std::optional<std::pair<double, double>> range() const;
  [[nodiscard]] bool is_stale() const { return is_stale_; }
  [[nodiscard]] bool can_refresh() const { return can_refresh_; }
  /// The changes since it was made, or why it cannot be made again.
  [[nodiscard]] const QString& stale_text() const { return stale_text_; }
  /// The command that made it; "" = it was given or read.
  [[nodiscard]] const std::string& command() const { return command_; }
  [[nodiscard]] bool is_gone() const { return is_gone_; }
  /// Whether samples or bands are being loaded.
  [[nodiscard]] bool is_loading() const { return loads_ > 0; }

  Listeners<> described;  ///< columns, title, or whether it is out of date
  Listeners<> filled;     ///< samples or bands

 private:
  void take(const ioci::Event& event);
  void describe();
  void ask_stale();
  void ask_bands();
  void load();
  void load_rows();
  void take_bands(const List& rows);

  Desk& desk_;
  Handle source_;
  QString title_;
  std::vector<ColumnInfo> columns_;
  std::vector<Band> bands_;
  std::set<std::string> wanted_;
  TimesPtr times_;
  std::map<std::string, std::shared_ptr<const Series>> series_;
  // Of a live run, which grows here.
  std::shared_ptr<Numbers64> run_times_;
  std::map<std::string, std::shared_ptr<Series>> run_series_;
  std::size_t run_restarts_ = 0;
  bool is_reading_rows_ = false, has_more_rows_ = false;
  bool is_stale_ = false, can_refresh_ = false, is_gone_ = false;
  QString stale_text_;
  std::string command_;
  int loads_ = 0;
  std::uint64_t generation_ = 0;  ///< counts replaced tables, so that late answers are dropped
  bool is_load_wanted_ = false;
  QTimer stale_timer_, load_timer_;
};

}  // namespace robomosp::viewer
