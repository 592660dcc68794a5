// SPDX-License-Identifier: GPL-3.0-or-later
// Jobs: the panel with the work that runs in the background, its progress, and a button that
// cancels it (layer: GUI).
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>

#include <QElapsedTimer>
#include <QWidget>

#include "kernel/jobs.h"
#include "viewer/desktop/desk.h"

class QLabel;
class QProgressBar;
class QToolButton;
class QVBoxLayout;

namespace robomosp::viewer {

/// [GUI thread]
class JobsPanel : public QWidget {
 public:
  explicit JobsPanel(Desk& desk, QWidget* parent = nullptr);

  /// Jobs that wait or run.
  [[nodiscard]] std::size_t running() const;
  /// The one that started last, for the status bar; null if none runs.
  [[nodiscard]] const JobStatus* current() const;
  void cancel(std::uint64_t job);
  void cancel_all();

  Listeners<> changed;

 private:
  struct Row {
    JobStatus status;
    QElapsedTimer since;
    QWidget* widget = nullptr;
    QLabel *icon = nullptr, *label = nullptr, *state = nullptr;
    QProgressBar* bar = nullptr;
    QToolButton* cancel = nullptr;
  };
  void take(const JobStatus& status);
  void make_row(Row& row);
  void show_row(Row& row);

  Desk& desk_;
  QVBoxLayout* column_;
  QLabel* none_;
  std::map<std::uint64_t, Row> rows_;
};

}  // namespace robomosp::viewer
