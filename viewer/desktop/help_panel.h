// SPDX-License-Identifier: GPL-3.0-or-later
// HelpPanel: the pages of the documentation, inside the window and without a network (layer: GUI).
#pragma once

#include <functional>
#include <vector>

#include <QString>
#include <QStringList>
#include <QWidget>

#include "viewer/desktop/desk.h"
#include "viewer/desktop/manual.h"
#include "viewer/theme/theme.h"

class QLineEdit;
class QTextBrowser;
class QToolButton;
class QUrl;

namespace robomosp::viewer {

/// Shows "user/desktop.md#views", "command:robot.fk", "topic:robot" (the commands of a topic),
/// "topics", "examples", "search:WORDS" or "contents". [GUI thread]
class HelpPanel : public QWidget {
 public:
  explicit HelpPanel(Desk& desk, QWidget* parent = nullptr);

  void open(const QString& page);
  void back();
  void forward();
  void focus_search();
  [[nodiscard]] QString page() const;
  [[nodiscard]] const Manual& manual() const { return manual_; }
  [[nodiscard]] QTextBrowser& browser() const { return *browser_; }
  /// Lua of the examples on the page, in their order; link "run:2" runs the third.
  [[nodiscard]] const QStringList& examples() const { return examples_; }

  /// Runs an example; set by the window.
  std::function<void(const QString& lua)> on_run;

 protected:
  void changeEvent(QEvent* event) override;

 private:
  struct Visit {
    QString page;
    int scrolled = 0;
  };
  void show_page(const QString& page, int scrolled);
  void show_markdown(const QString& text);
  void follow(const QUrl& link);
  void style_text();
  void scroll_to_anchor(const QString& anchor);
  void show_state();
  void apply_theme();
  [[nodiscard]] QString contents() const;
  [[nodiscard]] QString topics() const;
  [[nodiscard]] QString example_scripts() const;
  [[nodiscard]] QString topic(const QString& name) const;
  [[nodiscard]] QString found(const QString& words) const;

  Desk& desk_;
  Manual manual_;
  QTextBrowser* browser_;
  QLineEdit* search_;
  QToolButton *back_, *forward_, *contents_;
  std::vector<Visit> visits_;
  std::size_t at_ = 0;  ///< of visits_
  QStringList examples_;
  QString file_;                   ///< of the page, for its links; "" = of none
  int asked_ = 0;                  ///< pages shown, so that a late answer is dropped
  int themed_ = theme_revision();  ///< the theme that it shows
};

/// The page for a widget: the command in its tool tip, or the chapter that describes its panel.
[[nodiscard]] QString help_page_of(const QWidget* widget);
/// The page of a command that a text with a call names: "robot.fk" of "robot.fk{...}"; "" = none.
[[nodiscard]] QString command_in(const QString& text);

}  // namespace robomosp::viewer
