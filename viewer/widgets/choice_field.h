// SPDX-License-Identifier: GPL-3.0-or-later
// ChoiceField: one of several values chosen from a list that can be searched: words, records,
// members, providers (layer: GUI).
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include <QColor>
#include <QFrame>

#include "viewer/widgets/field.h"

class QLabel;
class QLineEdit;
class QListWidget;

namespace robomosp::viewer {

struct FieldChoice {
  Value value;
  QString label;             ///< shown instead of the value
  QString doc{}, why_not{};  ///< `why_not`: the reason why it cannot be chosen now
  QColor swatch{};           ///< of a material; invalid = none
};

/// How a choice looks: the colour of its ball, and a remark on it.
struct ChoiceLook {
  QColor swatch{};
  QString doc{};
};
/// A ball in a colour, lit from the upper left.
void paint_ball(QPainter& painter, const QRectF& place, const QColor& colour);

/// The list that a ChoiceField opens: a line to search, the choices, and why the current one
/// cannot be chosen. Closes itself after a choice and on Escape.
class ChoicePopup : public QFrame {
 public:
  explicit ChoicePopup(QWidget* parent);
  /// `takes_text`: a text that matches no choice can be chosen.
  void open_at(QWidget* field, bool takes_text, const QString& typed);
  void show_choices(const std::vector<FieldChoice>& choices, const std::optional<Value>& current);
  /// Fills in how a choice looks, once it is known.
  void show_look(const Value& choice, const ChoiceLook& look);
  /// Rows are high enough for balls.
  void set_has_swatches(bool on);
  std::function<void(const Value&)> on_choose;
  std::function<void()> on_close;
  /// Called when another beginning is typed.
  std::function<void(const QString&)> on_prefix;
  [[nodiscard]] QLineEdit* search() const { return search_; }
  [[nodiscard]] QListWidget* list() const { return list_; }

 protected:
  bool eventFilter(QObject* object, QEvent* event) override;
  void hideEvent(QHideEvent* event) override;

 private:
  void filter();
  void choose_row(int row);
  QLineEdit* search_;
  QListWidget* list_;
  QLabel* about_;
  std::vector<FieldChoice> choices_;
  std::optional<Value> current_;
  bool takes_text_ = false, has_swatches_ = false;
};

/// Click, Space, Enter, Alt+Down or F4 opens the list; typing opens it with what was typed; Up and
/// Down take the neighbour; Delete takes the default.
class ChoiceField : public Field {
 public:
  using Answer = std::function<void(std::vector<FieldChoice>)>;
  using Ask = std::function<void(const QString& prefix, Answer answer)>;
  using Look = std::function<void(const Value& choice, std::function<void(ChoiceLook)> answer)>;

  explicit ChoiceField(QWidget* parent = nullptr);

  [[nodiscard]] std::optional<Value> value() const override { return value_; }
  void set_value(const std::optional<Value>& value) override;
  /// Fixed choices.
  void set_choices(std::vector<FieldChoice> choices);
  /// Choices that depend on what is given elsewhere; asked each time the list is opened.
  void set_ask(Ask ask) { ask_ = std::move(ask); }
  /// Asked for the colours of choices, such as of materials.
  void set_look(Look look);
  void set_takes_text(bool on) { takes_text_ = on; }
  /// A text of digits is a number, such as that of a link.
  void set_takes_numbers(bool on) { takes_numbers_ = on; }
  void set_icon(std::string_view icon);
  void set_may_be_empty(bool on) { may_be_empty_ = on; }
  void open_list(const QString& typed = {});
  [[nodiscard]] ChoicePopup* popup() const { return popup_; }
  [[nodiscard]] QString shown_text() const;

  QSize sizeHint() const override;
  QSize minimumSizeHint() const override;

 protected:
  void paintEvent(QPaintEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;

 private:
  void choose(const Value& value);
  void step(int by);
  void ask_look();
  std::optional<Value> value_;
  std::vector<FieldChoice> choices_;
  Ask ask_;
  Look look_;
  QColor swatch_;  ///< of the value
  bool takes_text_ = false, takes_numbers_ = false, may_be_empty_ = true;
  std::string icon_;
  ChoicePopup* popup_ = nullptr;
  int asked_ = 0;  ///< counts questions, so that a late answer of an older one is dropped
};

}  // namespace robomosp::viewer
