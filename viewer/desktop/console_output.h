// SPDX-License-Identifier: GPL-3.0-or-later
// ConsoleOutput: the lines of the console, with small pictures of results between them (layer:
// GUI). Pictures are limited in size and number; copied text has none of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include <QImage>
#include <QPlainTextEdit>
#include <QRect>
#include <QString>
#include <QTextBlock>

#include "kernel/value.h"

namespace robomosp::viewer {

/// [GUI thread]
class ConsoleOutput : public QPlainTextEdit {
 public:
  /// At most so many pictures are shown; of earlier ones the titles stay.
  static constexpr std::size_t kMostPictures = 20;
  /// Their results take at most so much memory together [bytes].
  static constexpr std::size_t kMostBytes = std::size_t{32} << 20;

  explicit ConsoleOutput(QWidget* parent = nullptr);
  ~ConsoleOutput() override;  ///< waits for pictures that are being drawn

  /// A picture of a result, and what a click on it opens.
  struct Source {
    QString title;
    Value result;           ///< as ResultView shows it
    std::size_t bytes = 0;  ///< memory that the result takes
  };
  /// Adds a block with the title; the picture follows by draw(). Returns its number.
  std::uint64_t add_picture(Source source);
  /// Draws the picture on a thread of the executor, by a function that returns null if it cannot.
  void draw(std::uint64_t number, std::function<QImage()> make);
  /// Replaces a picture that cannot be drawn by a sentence.
  void give_up(std::uint64_t number, const QString& why);
  /// Removes the block of a picture.
  void remove(std::uint64_t number);
  /// Largest size of a picture, in pixels of the screen.
  [[nodiscard]] QSize most_pixels() const;
  [[nodiscard]] bool is_drawing() const;
  /// All lines without the pictures.
  [[nodiscard]] QString text() const;
  /// Number of pictures that are shown.
  [[nodiscard]] std::size_t pictures() const;
  /// Where the picture that was added last is now; empty if it is not visible.
  [[nodiscard]] QRect last_picture_place() const;
  /// Makes space for the pictures again, after a change of the font.
  void refit();

  /// Opens a result.
  std::function<void(const QString& title, const Value& result)> on_open;

 protected:
  void paintEvent(QPaintEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;
  void contextMenuEvent(QContextMenuEvent* event) override;
  bool viewportEvent(QEvent* event) override;
  QMimeData* createMimeDataFromSelection() const override;

 private:
  class Picture;
  struct Drawing;
  [[nodiscard]] static Picture* picture_of_block(const QTextBlock& block);
  [[nodiscard]] QTextBlock block_of(std::uint64_t number) const;
  [[nodiscard]] QRect place_of(const QTextBlock& block) const;
  [[nodiscard]] QTextBlock picture_at(const QPoint& at) const;
  void take(std::uint64_t number, const QImage& image);
  void reserve(const QTextBlock& block);
  void drop_oldest();
  void open(const QTextBlock& block);
  [[nodiscard]] QString text_between(int from, int to) const;

  std::uint64_t next_ = 1;
  std::shared_ptr<Drawing> drawing_;
  QPoint pressed_;
};

}  // namespace robomosp::viewer
