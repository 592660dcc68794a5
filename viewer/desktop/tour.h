// SPDX-License-Identifier: GPL-3.0-or-later
// Tour: photographs every panel of the window on worlds of the library, dark and light, at two
// sizes of the interface (layer: GUI).
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <QElapsedTimer>
#include <QObject>
#include <QPointer>
#include <QSize>
#include <QStringList>
#include <QTimer>
#include <QWidget>

#include <robomosp/sdk/result.h>

namespace robomosp::viewer {

class MainWindow;
struct ViewLook;

/// [GUI thread]
class Tour : public QObject {
 public:
  /// `size` is that of the window; of `only` the names of pictures ("motion-dark"), empty = all;
  /// `done` gets the first failure.
  Tour(MainWindow& window, std::string folder, QSize size, std::vector<std::string> only,
       std::function<void(const Result<void>&)> done);

 private:
  struct Step {
    std::string picture;  ///< name of its file without the ending; "" = none is taken
    std::function<void()> act;
    QPointer<QWidget>* of = nullptr;  ///< pictured instead of the window
  };
  void add_round(bool is_dark, double zoom);
  /// Drops steps after the last picture that is wanted, and pictures that are not.
  void keep_wanted(std::size_t first);
  void expand(const QStringList& rows);
  void look_at(const std::function<void(ViewLook&)>& change);
  void add_motion(const std::function<void(const std::string&, std::function<void()>)>& photo);
  void add_widgets(const std::string& suffix);
  void add_act(std::function<void()> act) { steps_.push_back({"", std::move(act)}); }
  void next();
  void finish(const Result<void>& result);

  MainWindow& window_;
  std::string folder_;
  QSize size_;
  std::vector<std::string> only_;  ///< names that were not found yet
  std::function<void(const Result<void>&)> done_;
  std::vector<Step> steps_;
  QPointer<QWidget> widgets_;  ///< the page of all widgets
  std::size_t at_ = 0;
  bool has_acted_ = false;
  int settled_ = 0;
  QTimer timer_;
  QElapsedTimer since_;
};

}  // namespace robomosp::viewer
