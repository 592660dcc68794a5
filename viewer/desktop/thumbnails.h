// SPDX-License-Identifier: GPL-3.0-or-later
// Thumbnails: pictures of the records of the library, drawn by another process and kept in files
// named by the content of the records (layer: GUI).
#pragma once

#include <deque>
#include <map>
#include <set>
#include <string>
#include <utility>

#include <QObject>
#include <QPixmap>
#include <QProcess>
#include <QString>
#include <QTimer>

#include "kernel/value.h"
#include "viewer/desktop/listeners.h"

namespace robomosp::viewer {

/// Nothing is drawn if ROBOMOSP_NO_THUMBNAILS is set. [GUI thread]
class Thumbnails : public QObject {
 public:
  static constexpr int kWidth = 480, kHeight = 360;  ///< of the files [px]

  explicit Thumbnails(QObject* parent = nullptr);
  ~Thumbnails() override;  ///< ends the process that draws

  /// Takes the rows of library.describe with digests. A record with another digest gets another
  /// picture.
  void know(const std::string& kind, const List& rows);
  [[nodiscard]] bool knows(const std::string& kind) const { return kinds_.contains(kind); }
  /// Description of a library record; "" if it is not known.
  [[nodiscard]] QString description(const std::string& kind, const std::string& name) const;
  /// The file with the picture in the current theme, or else in the other one; "" = none is there.
  /// What is missing is drawn later.
  QString file(const std::string& kind, const std::string& name);
  /// A picture for a row, `height` high [device-independent px]. Null until it is loaded.
  QPixmap small(const std::string& kind, const std::string& name, int height, double ratio);
  /// True while a picture is drawn or waits for it.
  [[nodiscard]] bool is_drawing() const;

  /// Of the process that draws: 19 is the lowest, 0 that of the window.
  int niceness = 19;

  /// With the kind and name of a picture that is new, or loaded for a row.
  Listeners<const std::string&, const std::string&> drawn;
  /// Why a picture was not drawn; once for each start.
  Listeners<const QString&> failed;

 private:
  using Key = std::pair<std::string, std::string>;  ///< kind and name
  struct Known {
    QString file, digest, description;
  };
  [[nodiscard]] static QString folder();
  [[nodiscard]] QString picture_file(const Key& key, const Known& known, bool is_dark) const;
  void draw_soon();
  void draw_next();
  void take_drawn();
  void load_next();
  void forget_older(const QString& picture) const;

  std::map<Key, Known> known_;
  std::set<std::string> kinds_;
  std::deque<Key> to_draw_;
  std::set<QString> refused_;  ///< pictures that could not be drawn
  std::map<QString, QPixmap> small_;
  struct Load {
    Key key;
    QString file, name;
    int height = 0;
    double ratio = 1;
  };
  std::deque<Load> to_load_;
  std::set<QString> loading_;
  QTimer load_timer_;
  QProcess drawer_;
  Key drawn_key_;
  QString drawn_file_;
  int themed_ = 0;  ///< the theme of what waits
  bool is_busy_ = false, has_failed_ = false;
};

}  // namespace robomosp::viewer
