// SPDX-License-Identifier: GPL-3.0-or-later
// Sections below the fields of a record: its mass, who uses it, and what a recording says about a
// segment (layer: GUI).
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <QWidget>

#include "ioci/client/client.h"
#include "kernel/value.h"
#include "viewer/theme/theme.h"

class QGridLayout;
class QLabel;
class QToolButton;
class QVBoxLayout;

namespace robomosp::viewer {

class Gauge;

/// A heading that folds what is below it. It asks the client again by refresh().
class RecordSection : public QWidget {
 public:
  RecordSection(ioci::Client& client, const QString& title, const QString& name, QWidget* parent);
  /// Asks for its values. Calls made while an answer is missing are made once more after it.
  void refresh();
  /// Called after it was drawn anew.
  std::function<void()> on_shown;

 protected:
  void changeEvent(QEvent* event) override;
  /// Margins and heights of the present zoom.
  virtual void apply_theme();
  /// Asks; ends with finished().
  virtual void ask_values() = 0;
  void finished();
  /// A note at the right of the heading.
  void set_note(const QString& note);
  ioci::Client& client_;
  QVBoxLayout* column_;  ///< of the content

 private:
  QToolButton* head_;
  QLabel* note_;
  QWidget* content_;
  bool is_asking_ = false, is_wanted_ = false;
  int themed_ = theme_revision();
};

/// Mass, volume, surface, centre and principal moments of a solid or object, beside those that it
/// had when it was selected.
class MassSection : public RecordSection {
 public:
  MassSection(ioci::Client& client, Handle record, const QString& name, QWidget* parent);
  [[nodiscard]] const Handle& record() const { return record_; }
  /// The mass that is shown now [kg]; nothing = not known.
  [[nodiscard]] std::optional<double> mass() const;
  /// What is shown becomes what later values are compared with.
  void keep_as_before();

 protected:
  void ask_values() override;
  void apply_theme() override;

 private:
  struct Row {
    std::string name, unit;
    double factor;  ///< from SI to the shown unit
    int index;      ///< of a vector; -1 = a number
    QLabel *label, *before, *now, *change;
    std::optional<double> first, value;
  };
  void show_values(const Map& values);
  Handle record_;
  std::vector<Row> rows_;
  QLabel* fault_;
  QGridLayout* grid_;
};

/// The records that refer to a record, each a link.
class UsersSection : public RecordSection {
 public:
  UsersSection(ioci::Client& client, Handle record, QWidget* parent);
  [[nodiscard]] const Handle& record() const { return record_; }
  std::function<void(const Handle&)> on_go;

 protected:
  void ask_values() override;

 private:
  void show_users(const List& users);
  Handle record_;
  List shown_;
  std::vector<QWidget*> links_;
};

/// How near the newest recording of a trajectory comes to limits on one of its segments.
class SegmentSection : public RecordSection {
 public:
  SegmentSection(ioci::Client& client, Handle trajectory, std::string name, int segment,
                 QWidget* parent);
  [[nodiscard]] const Handle& trajectory() const { return trajectory_; }
  [[nodiscard]] int segment() const { return segment_; }
  [[nodiscard]] const std::vector<Gauge*>& gauges() const { return gauges_; }

 protected:
  void ask_values() override;

 private:
  void ask_recording();
  void ask_summary(const Handle& recording);
  void show_summary(const List& columns);
  void say(const QString& sentence);
  Handle trajectory_;
  std::string name_;
  int segment_;
  double from_ = 0, to_ = 0;
  std::vector<Gauge*> gauges_;
  QLabel* sentence_;
};

}  // namespace robomosp::viewer
